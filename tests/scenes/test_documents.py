"""Reading YAML and TOML: values and their places against the standard parsers, and what is refused at once."""

from __future__ import annotations

import time
import tomllib
from pathlib import Path

import pytest
import yaml

from qlb import InputError
from qlb.scenes.document import MOST_BYTES, Document, Node, SyntaxProblem, read_document
from qlb.scenes.files import PARSERS
from qlb.scenes.toml_document import parse_toml
from qlb.scenes.yaml_document import parse_yaml

YAML = """\
# a comment
a: 1
b: [1, 2.5, -3, "4", 'x y', plain text, .5, null, ~]
c:
  d: &anchor {e: true, f: false}
  g:
    - h: *anchor
    - <<: *anchor
      e: 3
    - - 1
      - |
        several
        lines
"""


def test_yaml_means_what_the_standard_parser_says():
    found = parse_yaml(YAML).plain()
    expected = yaml.safe_load(YAML)
    assert found == expected
    assert found["c"]["g"][1] == {"e": 3, "f": False}
    assert found["c"]["d"] is not found["c"]["g"][0]["h"]  # a copy


def test_scalars_are_those_of_yaml_1_2():
    text = "[1e5, 2E-3, -.5e1, 1., 0x1F, 0o17, 017, yes, on, 2001-01-01, 1:30, 1_000, .inf, -.Inf, +7, '1e5', 1e5x, =]"
    found = parse_yaml(text).plain()
    infinity = float("inf")
    words = ["yes", "on", "2001-01-01", "1:30", "1_000"]
    assert found == [1e5, 2e-3, -5.0, 1.0, 31, 15, 17, *words, infinity, -infinity, 7, "1e5", "1e5x", "="]
    assert isinstance(found[0], float)
    assert parse_yaml(".nan").value != parse_yaml(".nan").value
    assert parse_yaml("9" * 500).value == float("9" * 300 + "e200")


@pytest.mark.parametrize(
    ("key", "place"),
    [
        ("a", (2, 1)),
        ("b", (3, 1)),
        ("b.3", (3, 17)),
        ("c.d.e", (5, 15)),
        ("c.g.0.h", (7, 7)),
        ("c.g.1.e", (9, 7)),
        ("c.g.1.f", (5, 24)),
        ("c.g.2.1", (11, 9)),
        ("c.g.2.7", (10, 7)),
        ("c.nothing.here", (4, 1)),
        ("nothing", None),
    ],
)
def test_places_in_yaml(key, place):
    assert Document(Path("x.yaml"), parse_yaml(YAML)).place(key) == place


TOML = """\
# a comment
a = 1
b.c = [1, 2]   # dotted
"quoted key" = 3

[d]
  e = "text"
f = [
  1,
]

[[g]]
h = 1
i = {j = 2}

[[g]]
h = 2
[g.k]
l = 3
[[g.m]]
n = 4
[[g.m]]
n = 5
"""


def test_toml_means_what_the_standard_parser_says():
    assert parse_toml(TOML).plain() == tomllib.loads(TOML)


@pytest.mark.parametrize(
    ("key", "line"),
    [
        ("a", 2), ("b.c", 3), ("b.c.1", 3), ("quoted key", 4), ("d", 6), ("d.e", 7), ("d.f", 8), ("g", 12), ("g.0", 12),
        ("g.0.h", 13), ("g.0.i.j", 14), ("g.1", 16), ("g.1.h", 17), ("g.1.k", 18), ("g.1.k.l", 19), ("g.1.m", 20),
        ("g.1.m.0.n", 21), ("g.1.m.1.n", 23), ("g.1.m.1", 22),
    ],
)  # fmt: skip
def test_places_in_toml(key, line):
    place = Document(Path("x.toml"), parse_toml(TOML)).place(key)
    assert place is not None
    assert place.line == line


def laughs(levels: int) -> str:
    lines = ["a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]" for k in range(1, levels)]
    return "\n".join(lines)


YAML_PROBLEMS = [
    ("a: [1, 2", "2:1|1:9", "expected"),
    ("a: 1\nb: 2\na: 3", "3:1", "the key 'a' stands here again, first in line 1"),
    ("a: &x [*x]", "1:8", "alias *x is inside of what it stands for"),
    ("a: &x {b: {c: *x}}", "1:15", "alias *x is inside"),
    ("a: *x", "1:4", "alias *x stands for nothing"),
    (laughs(30), "", "more than 1000000 values"),
    ("[" * 60 + "]" * 60, "1:51", "more than 50 levels"),
    ("\n".join(f"{'  ' * k}a:" for k in range(60)), "50:99", "more than 50 levels"),
    ("[" * 10_000_0, "1:51", "more than 50 levels"),
    ("a: !!python/object/apply:os.system ['true']", "1:4", "tag"),
    ("a: !!set {b}", "1:4", "tag"),
    ("a: !mine 3", "1:4", "tag"),
    ("? [a, b]\n: 3", "1:3", "a key is a list"),
    ("? {a: b}\n: 3", "1:3", "a key is keys and values"),
    ("true: 3", "1:1", "a key is true or false"),
    ("1.5: 3", "1:1", "a key is 1.5"),
    ("a: 1\n---\nb: 2", "2:1", "second document"),
    ("<<: 3", "1:1", "<< is followed by 3"),
    ("a: \t- b\n\t- c", "", "not valid YAML"),
    ("a: b: c", "1:5", "mapping values"),
    ("a: '", "", "not valid YAML"),
    ("a: \x01", "", "not valid YAML"),
    ("%FOO\n", "", "not valid YAML"),
]


@pytest.mark.parametrize(("text", "place", "words"), YAML_PROBLEMS, ids=range(len(YAML_PROBLEMS)))
def test_what_is_wrong_in_yaml_is_refused_at_once_with_its_place(tmp_path, text, place, words):
    message = refused(tmp_path / "x.yaml", text)
    assert words in message
    assert any(message.startswith(f"{tmp_path / 'x.yaml'}:{p}".rstrip(":")) for p in place.split("|")), message


TOML_PROBLEMS = [
    ("a = 1\na = 2", "2:", "overwrite"),
    ("a = ", "1:5", "Invalid value"),
    ("[a]\n[a]\n", "2:", "twice"),
    ("a = " + "[" * 3000 + "]" * 3000, "", "nested too deep"),
    ("a = " + "[" * 60 + "]" * 60, "", "nested more than 50 levels"),
    ("\nx = 1\n" + ".".join("a" * 200_000) + " = 1", "3:1", "a key of more than 50 parts"),
    ("x = {" + ".".join("a" * 200_000) + " = 1}", "1:1", "a key of more than 50 parts"),
    ("[" + " . ".join("a" * 60) + "]", "1:1", "a key of more than 50 parts"),
    ("a = " + "9" * 10_000, "", "digits"),
    ("a", "1:2", "="),
]


@pytest.mark.parametrize(("text", "place", "words"), TOML_PROBLEMS, ids=range(len(TOML_PROBLEMS)))
def test_what_is_wrong_in_toml_is_refused_at_once_with_its_place(tmp_path, text, place, words):
    message = refused(tmp_path / "x.toml", text)
    assert words in message
    assert message.startswith(f"{tmp_path / 'x.toml'}:{place}".rstrip(":")), message


def refused(path: Path, text: str) -> str:
    path.write_text(text)
    begin = time.process_time()
    with pytest.raises(InputError) as refusal:
        read_document(path, PARSERS)
    assert time.process_time() - begin < 5
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) < 500
    return str(refusal.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is empty"),
        (b"- 1\n- 2", "holds list"),
        (b"just text", "holds str"),
        (b"a: \xff\xfe", "not UTF-8 text: byte 3 is 0xff"),
        (bytes(range(256)), "not UTF-8"),
        (b"a: 1 #" + b"x" * MOST_BYTES, f"at most {MOST_BYTES} are read"),
    ],
)
def test_files_that_are_no_scenes_are_refused(tmp_path, content, words):
    (tmp_path / "x.yaml").write_bytes(content)
    with pytest.raises(InputError, match=words):
        read_document(tmp_path / "x.yaml", PARSERS)


def test_a_byte_order_mark_is_no_part_of_the_text(tmp_path):
    (tmp_path / "x.yml").write_bytes(b"\xef\xbb\xbfa: 1\r\nb: 2\r\n")
    document = read_document(tmp_path / "x.yml", PARSERS)
    assert document.root.plain() == {"a": 1, "b": 2}
    assert document.place("b") == (2, 1)


def test_many_aliases_of_a_small_size_are_fine():
    text = "m: &m {young: 1e4}\nl: [" + ", ".join(["*m"] * 1000) + "]"
    assert parse_yaml(text).plain()["l"] == [{"young": 1e4}] * 1000
    with pytest.raises(SyntaxProblem):
        Node.of([Node.of([Node.of(0)] * 1000)] * 1000)
