"""DOF labels such as "n6.y"."""

from __future__ import annotations

from cvxupdate.errors import ModelError

KINDS = ("x", "y", "z", "rx", "ry", "rz")


def parse_label(label: str) -> tuple[int, int]:
    """ "n6.y" → (6, 1).

    Raises
    ------
    ModelError
        When the label is not of that form.
    """
    node, _, kind = label.partition(".")
    if not node.startswith("n") or not node[1:].isdigit() or kind not in KINDS:
        raise ModelError(f'the DOF label {label!r} is not understood. Write it like "n6.y".')
    return int(node[1:]), KINDS.index(kind)
