"""Generic elements (chapter 7): families of element matrices that keep the rigid-body modes and the
symmetry of an element, as parameters of a model."""
