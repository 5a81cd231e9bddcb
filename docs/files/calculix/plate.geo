// A steel plate 0.4 x 0.3 x 0.006 m, its edge at x = 0 clamped. gmsh -3 plate.geo -o mesh.inp
SetFactory("OpenCASCADE");
Rectangle(1) = {0, 0, -0.003, 0.4, 0.3};
Transfinite Curve{1, 3} = 6;
Transfinite Curve{2, 4} = 5;
Transfinite Surface{1};
Recombine Surface{1};
out[] = Extrude{0, 0, 0.006}{ Surface{1}; Layers{1}; Recombine; };
Physical Volume("plate") = {out[1]};
Physical Surface("clamp") = {5};
Mesh.ElementOrder = 2;
Mesh.SecondOrderIncomplete = 1;
Mesh.SaveGroupsOfNodes = 1;
Mesh.SaveGroupsOfElements = -1000;
