"""What was found on a finer mesh, in the numbers of the file: an analyst looks them up there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from cvxupdate.diagnose.output.diagnosis import Diagnosis
from cvxupdate.diagnose.results import Finding
from cvxupdate.fe.refinement import Refined
from cvxupdate.physics.place import capital, listed, numbered


def in_file_numbers(found: Diagnosis, mesh: Refined) -> Diagnosis:
    """A diagnosis on a finer ``mesh``, whose findings name the elements of the file, and whose
    sentences say which part of them is meant and between which nodes those lie that were made."""
    findings, says = [], found.says
    for finding in found.findings:
        now = _in_file(finding, mesh)
        says = says.replace(finding.says, now.says)
        findings.append(now)
    return replace(found, says=says, findings=tuple(findings))


def _in_file(finding: Finding, mesh: Refined) -> Finding:
    place = finding.place
    words = [*_elements(place.elements, mesh), *_nodes(place.nodes, mesh)]
    if not words:
        return finding
    of = {part: number for number, parts in mesh.parts.items() for part in parts}
    elements = tuple(dict.fromkeys(of.get(i, i) for i in place.elements))
    says = f"{finding.says} ({capital('; '.join(words))}.)"
    return replace(finding, in_file=replace(place, elements=elements), says=says)


def _elements(elements: Sequence[int], mesh: Refined) -> list[str]:
    """Of each divided element of the file, which of its parts they are."""
    words = []
    for number, parts in mesh.parts.items():
        mine = [i for i in parts if i in elements]
        if not mine or len(parts) == 1:
            continue
        of = f"element {number} of the file"
        if len(mine) == len(parts):
            words.append(f"{_named(mine)} are the whole of {of}")
            continue
        which = listed([parts.index(i) + 1 for i in mine])
        words.append(
            f"{_named(mine)} {'are parts' if len(mine) > 1 else 'is part'} {which} of "
            f"{len(parts)} of {of}, from its first node on"
        )
    return words


def _named(elements: Sequence[int]) -> str:
    return f"element{'s' * (len(elements) > 1)} {numbered(elements)}"


def _nodes(nodes: Sequence[int], mesh: Refined) -> list[str]:
    """Where those lie that the file does not have."""
    words = []
    for n in nodes:
        if n in mesh.made and len(mesh.made[n].weights) == 2:
            (a, _), (b, way) = sorted(mesh.made[n].weights.items())
            words.append(f"node {n} lies {100 * way:.3g} % of the way from node {a} to node {b}")
    return words
