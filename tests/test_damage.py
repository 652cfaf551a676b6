"""Damaged documents: one clear error with its place, or a verdict on every display that is left; never anything else."""

from __future__ import annotations

import random
import re

import pytest

from yarnverify.errors import InputError
from yarnverify.library import Shelf
from yarnverify.source import Source
from yarnverify.symbolic.record import prove_source

DOCUMENT = r"""## Contact

Assumed: $\Delta u = u_1 - u_0 < d$.

$$V = \frac{1}{2} k_c L (\Delta u - d)^2. \quad (1)$$

$$F_{u_0} = -F_{u_1} = k_c L (\Delta u - d). \quad (2)$$

$$\frac{\partial F_{u_0}}{\partial u_0} = \frac{\partial F_{u_1}}{\partial u_1} = -k_c L. \quad (3)$$

$$\frac{\partial F_{u_0}}{\partial u_1} = \frac{\partial F_{u_1}}{\partial u_0} = k_c L. \quad (4)$$
"""
PIECES = [
    *(
        "{",
        "}",
        "$",
        "$$",
        "\\",
        "^",
        "_",
        "(",
        ")",
        "|",
        r"\|",
        "=",
        "<",
        "/",
        ",",
        "--",
        "&",
        "0",
        "1/0",
        "(2)",
        r"\tag{9}",
    ),
    *("\x00", "\ufeff", "\r\n", "\t", "\u2212", "\U0001d73d", "\n\n", "## More\n\n", "9" * 120, "{" * 80, "(" * 70),
    *(
        "V",
        "F_{u_1}",
        r"\frac",
        r"\sqrt",
        r"\left(",
        r"\right)",
        r"\mathbf{",
        r"\mathbf{x}_1",
        r"\partial",
        r"\theta",
        r"\pi",
    ),
    *(r"\arccos", r"\ln", r"\operatorname{atan2}", r"\text{x}", r"\begin{align}", r"\cdot", r"\times"),
    *("^2", "^{-1}", "^{99}", "^T", "_i"),
]


def damaged(text: str, draw: random.Random) -> str:
    """A text with one piece of it lost, doubled, exchanged, or something strange put in."""
    at, length = draw.randrange(len(text)), draw.randrange(1, 30)
    lines = text.split("\n")
    draw.shuffle(lines)
    commands = list(re.finditer(r"\\[A-Za-z]+|[A-Za-z0-9]", text)) or [re.match("", text)]
    one, other = draw.choice(commands), draw.choice(commands)
    assert one is not None and other is not None
    return draw.choice(
        [
            text[:at],
            text[at:],
            text[:at] + text[at + length :],
            text[: at + length] + text[at:],
            text[:at] + draw.choice(PIECES) + text[at:],
            text[:at] + draw.choice(PIECES) + text[at + 1 :],
            text[: one.start()] + other[0] + text[one.end() :],
            text.replace("\n", "\r\n"),
            "\n".join(lines),
        ]
    )


def check(text: str) -> None:
    source = Source("damaged.md", text)
    try:
        record = prove_source(source, Shelf(None, "damaged.md", "by itself alone"))
    except InputError as error:
        message = str(error)
        assert re.match(r"damaged\.md:\d+:\d+: \S", message) and "\n" not in message, message
        return
    displays = [match for match in re.findall(r"<!--.*?-->|\$\$.*?\$\$", text, re.DOTALL) if match.startswith("$$")]
    judged = {item["equation"] for item in (*record["claims"], *record["given"])}
    assert len(displays) == len(record["equations"]), "a display is skipped"
    assert judged >= set(record["equations"]), "an equation is skipped"
    assert not {"undecided", "inconsistent"} & {claim["verdict"] for claim in record["claims"]}


@pytest.mark.parametrize("seed", range(12))
def test_a_damaged_document_is_refused_or_judged(seed: int) -> None:
    draw = random.Random(seed)
    for _ in range(20):
        text = DOCUMENT
        for _ in range(draw.choice((1, 1, 2, 3))):
            text = damaged(text or " ", draw)
        check(text)
