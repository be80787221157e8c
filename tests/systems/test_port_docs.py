"""What a LeafSystem's docstring says about its ports is what the system has."""

import importlib
import inspect
import pkgutil
import re
from dataclasses import dataclass

import pytest
import yaml
from pydrake.common.cpp_template import TemplateClass
from pydrake.common.value import Value
from pydrake.systems.framework import LeafSystem, OutputPort, PortDataType

import sightfield.diagrams
import sightfield.hardware_io
import sightfield.systems


@dataclass
class PortDocs:
    """A docstring's account of the ports.

    Attributes:
        name: Name of the system in its block.
        inputs: Names of the input ports in the block, in order.
        outputs: The same for the output ports.
        table: Rows of the table of ports, each a dict by column heading.
    """

    name: str
    inputs: list[str]
    outputs: list[str]
    table: list[dict[str, str]]


def system_name(system: type) -> str:
    """Name of a system's class, without the marks of a template's instantiation."""
    # pydrake names the float instantiation of `Plant_` "Plant_" + U+1D4E3 + "float" + U+1D4E4.
    return re.sub(r"_\U0001d4e3.*\U0001d4e4$", "", system.__name__)


def subclasses(base: type) -> set[type]:
    """All classes below another, at any depth."""
    direct = set(base.__subclasses__())
    return direct.union(*(subclasses(each) for each in direct))


def systems_of_the_package() -> list[type]:
    """Every LeafSystem that a module of the package defines; templates at T = float."""
    for package in (sightfield.systems, sightfield.diagrams, sightfield.hardware_io):
        for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
            # A template makes its float class when first asked for it.
            for thing in vars(importlib.import_module(module.name)).values():
                if isinstance(thing, TemplateClass):
                    thing[float]
    found = [each for each in subclasses(LeafSystem) if each.__module__.startswith("sightfield.")]
    return sorted(found, key=lambda each: (each.__module__, each.__name__))


def read_block(doc: str) -> tuple[str, list[str], list[str]]:
    """The `.. pydrake_system::` block: name, input ports, output ports."""
    match = re.search(r"^\.\. pydrake_system::\n\n((?:(?: {4}.*)?\n)+)", doc + "\n", re.MULTILINE)
    assert match, "no `.. pydrake_system::` block, indented by 4"
    block = yaml.safe_load(inspect.cleandoc(match[1]))
    assert set(block) <= {"name", "input_ports", "output_ports"}, set(block)
    return block["name"], block.get("input_ports", []), block.get("output_ports", [])


def read_table(doc: str) -> list[dict[str, str]]:
    """Rows of the table whose first heading is `port`; a row without a port goes on with a cell."""
    lines = doc.splitlines()
    rulers = [i for i, line in enumerate(lines) if re.fullmatch(r"=+(?: +=+)+", line.strip())]
    tables = [
        (top, under, bottom)
        for top, under, bottom in zip(rulers, rulers[1:], rulers[2:], strict=False)
        if under == top + 2 and lines[top + 1].split()[:1] == ["port"]
    ]
    assert len(tables) == 1, f"one table with a heading `port`; got {len(tables)}"
    top, under, bottom = tables[0]
    starts = [match.start() for match in re.finditer(r"=+", lines[top])]
    cuts = list(zip(starts, [*starts[1:], None], strict=True))
    headings = [lines[top + 1][a:b].strip() for a, b in cuts]
    rows: list[dict[str, str]] = []
    for line in lines[under + 1 : bottom]:
        cells = dict(zip(headings, (line[a:b].strip() for a, b in cuts), strict=True))
        if cells["port"]:
            rows.append(cells)
        else:
            for heading, more in cells.items():
                rows[-1][heading] = f"{rows[-1][heading]} {more}".strip()
    return rows


def read_port_docs(system: type) -> PortDocs:
    """Read the docstring of a LeafSystem."""
    assert system.__doc__, "no docstring"
    doc = inspect.cleandoc(system.__doc__)
    return PortDocs(*read_block(doc), read_table(doc))


def feedthrough_of(system: LeafSystem, output: OutputPort) -> str:
    """Which inputs an output looks at in the same moment, as the table of ports has it."""
    through, rest = [], []
    for i in range(system.num_input_ports()):
        known = through if system.HasDirectFeedthrough(i, output.get_index()) else rest
        known.append(system.get_input_port(i).get_name())
    if not through:
        return "-"
    if not rest:
        return "all"
    few = len(through) <= max(len(rest), 2)
    return ", ".join(through) if few else f"all but {', '.join(rest)}"


def check_ports_are_as_documented(system: LeafSystem) -> None:
    """Assert that names, order and sizes of the ports are those of the docstring."""
    docs = read_port_docs(type(system))
    inputs = [system.get_input_port(i) for i in range(system.num_input_ports())]
    outputs = [system.get_output_port(i) for i in range(system.num_output_ports())]

    assert docs.name == system_name(type(system))
    assert docs.inputs == [port.get_name() for port in inputs]
    assert docs.outputs == [port.get_name() for port in outputs]

    ports = {port.get_name(): port for port in inputs + outputs}
    assert len(ports) == len(inputs) + len(outputs), "an input and an output share a name"
    assert all(re.fullmatch(r"[a-z][a-z0-9]*(_[a-z0-9]+)*", name) for name in ports), list(ports)
    assert sorted(row["port"] for row in docs.table) == sorted(ports)
    for row in docs.table:
        port = ports[row["port"]]
        if inputs and outputs:
            reached = feedthrough_of(system, port) if port in outputs else "-"
            assert row.get("feedthrough") == reached, row["port"]
        assert row.get("size"), f"{row['port']} has no size"
        assert row.get("unit"), f"{row['port']} has no unit ('-' where it has none)"
        if port.get_data_type() == PortDataType.kAbstractValued:
            assert not row["size"].isdigit(), f"{row['port']} is abstract: name its type"
        elif row["size"].isdigit():
            assert int(row["size"]) == port.size(), row["port"]


SYSTEMS = systems_of_the_package()


def test_the_package_has_systems():
    assert SYSTEMS


def test_every_system_has_an_example_and_every_example_a_system(system_examples):
    assert sorted(system_examples) == sorted(system_name(each) for each in SYSTEMS)


@pytest.mark.parametrize("system", SYSTEMS, ids=system_name)
def test_ports_are_as_documented(system, system_examples):
    example = system_examples[system_name(system)]()
    assert type(example) is system
    check_ports_are_as_documented(example)


@pytest.mark.parametrize("system", SYSTEMS, ids=system_name)
def test_numeric_parameters_are_as_documented(system, system_examples):
    example = system_examples[system_name(system)]()
    said = re.search(r"Numeric\s+parameters:\s+(.*?)\.(\s|$)", system.__doc__, re.DOTALL)
    named = re.findall(r"`(\w+)`", said[1]) if said else []
    assert named == list(example.parameters.names if said else ())
    context = example.CreateDefaultContext()
    assert context.num_numeric_parameter_groups() == bool(named)


class Documented(LeafSystem):
    """A system that is what it says.

    .. pydrake_system::

        name: Documented
        input_ports:
        - position
        output_ports:
        - speed
        - picture

    ========  =====  ====  ===================  ===========
    port      size   unit  frame                feedthrough
    ========  =====  ====  ===================  ===========
    position  2 N    m     world, x east and    -
                           y north
    speed     1      m/s   -                    all
    picture   Image  -     camera               -
    ========  =====  ====  ===================  ===========
    """

    def __init__(self, names=("position", "speed", "picture"), speed_size=1):
        super().__init__()
        self.DeclareVectorInputPort(names[0], 6)
        self.DeclareVectorOutputPort(names[1], speed_size, lambda context, output: None)
        self.DeclareAbstractOutputPort(
            names[2],
            lambda: Value(""),
            lambda context, output: None,
            {self.time_ticket()},
        )


def with_docstring(doc: str) -> LeafSystem:
    """The system above with another docstring."""
    return type("Documented", (Documented,), {"__doc__": doc})()


def test_a_system_that_is_what_it_says_passes():
    check_ports_are_as_documented(Documented())


def test_a_cell_may_go_on_in_the_next_line():
    assert read_port_docs(Documented).table[0]["frame"] == "world, x east and y north"


@pytest.mark.parametrize(
    "arguments",
    [
        {"names": ("place", "speed", "picture")},
        {"names": ("position", "picture", "speed")},
        {"names": ("position", "speed", "image")},
        {"speed_size": 2},
    ],
)
def test_a_system_with_other_ports_than_it_says_fails(arguments):
    with pytest.raises(AssertionError):
        check_ports_are_as_documented(Documented(**arguments))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("name: Documented", "name: Other"),
        ("- position", "- place"),
        ("- speed\n    - picture", "- picture\n    - speed"),
        ("position  2 N ", "place     2 N "),
        ("2 N    m  ", "2 N       "),
        ("speed     1      m/s", "speed            m/s"),
        ("speed     1      m/s", "speed     2      m/s"),
        ("picture   Image", "picture   3    "),
        ("picture   Image  -     camera               -\n", ""),
        ("                    all", "                    -  "),
        ("camera               -", "camera               all"),
        (".. pydrake_system::", "Ports:"),
        ("port      size", "gate      size"),
    ],
)
def test_a_docstring_that_says_otherwise_fails(old, new):
    # From Python 3.13 on, the compiler takes the indentation off docstrings.
    doc = inspect.cleandoc(str(Documented.__doc__))
    assert doc.count(old) == 1
    with pytest.raises(AssertionError):
        check_ports_are_as_documented(with_docstring(doc.replace(old, new)))
