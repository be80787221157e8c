"""Scenarios from YAML files: built-in ones by name, others by path, with values set from outside.

Checked by pydantic against the scenario's dataclasses: unknown keys are errors, and every message
names the key from the root, as in `pursuers.top_speed`.
"""

from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from functools import lru_cache
from importlib import import_module, resources
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple, TypeVar, get_args, get_type_hints

import yaml
from pydantic import ConfigDict, TypeAdapter, ValidationError, with_config

from ..systems.numerics.errors import InvalidInput, require
from ..systems.numerics.files import read_yaml
from ..systems.numerics.units import WrongQuantity
from . import scenarios

Schema = TypeVar("Schema")

# Configuration of Pydantic with which unknown keys of a scenario are refused; dataclasses within
# another inherit it.
NO_OTHER_KEYS = ConfigDict(extra="forbid")


class Setting(NamedTuple):
    """One value that is set from outside.

    Attributes:
        key: Dotted from the root.
        text: The value in YAML; None: it is set after the scenario is made, but set all the same.
        said: Where it is said, as "--set seconds=5" or "--seconds".
    """

    key: str
    text: str | None
    said: str

    @classmethod
    def read(cls, words: str) -> "Setting":
        """What `--set` has.

        Args:
            words: Of the form key=value.

        Raises:
            InvalidInput: They have another form.
        """
        key, equals, text = words.partition("=")
        require(bool(equals and key), "--set", "have the form key=value", words)
        return cls(key, text, f"--set {words}")


def builtin_scenarios(package: ModuleType = scenarios) -> list[str]:
    """Names of the scenarios that come in a package, by default those of `sightfield track`."""
    folder = resources.files(package)
    return sorted(Path(each.name).stem for each in folder.iterdir() if each.name.endswith(".yaml"))


def find_scenario(name: str, package: ModuleType = scenarios) -> Path:
    """The file of a scenario in a package, or the path itself.

    Raises:
        InvalidInput: Neither a built-in name nor a file.
    """
    if name in builtin_scenarios(package):
        return Path(str(resources.files(package).joinpath(f"{name}.yaml")))
    path = Path(name)
    known = ", ".join(builtin_scenarios(package))
    require(path.is_file(), "scenario", f"be a YAML file or one of {known}", name)
    return path


def load_scenario(
    schema: type[Schema], scenario: str | Path, overrides: Sequence[str | Setting] = ()
) -> Schema:
    """Read a scenario.

    Args:
        schema: Its dataclass.
        scenario: Its file, or the name of a built-in one.
        overrides: `key=value` settings, the key dotted from the root, the value in YAML.

    Raises:
        InvalidInput: There is no such scenario; the file is no YAML mapping; a key is unknown, or
            set twice; a value has the wrong type or breaks a rule of the dataclass.
    """
    if isinstance(scenario, str):
        scenario = find_scenario(scenario, _built_in(schema))
    return build(schema, with_settings(read_tree(scenario), overrides))


def _built_in(schema: type) -> ModuleType:
    """The package of scenarios that is nearest to a dataclass, beside it or above."""
    place = schema.__module__
    while place := place.rpartition(".")[0]:
        if find_spec(f"{place}.scenarios"):
            return import_module(f"{place}.scenarios")
    return scenarios


def read_tree(path: Path) -> dict[str, Any]:
    """The nested mappings and lists of a YAML file.

    Raises:
        InvalidInput: The file is no YAML mapping, or cannot be read.
    """
    try:
        tree = read_yaml(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError, OSError) as error:
        raise InvalidInput(
            f"`scenario` must be readable YAML; got {path}: {' '.join(str(error).split())}"
        ) from None
    require(isinstance(tree, dict), "scenario", "be a YAML mapping of keys to values", path)
    return tree


def with_settings(tree: dict[str, Any], overrides: Sequence[str | Setting]) -> dict[str, Any]:
    """Nested mappings and lists with settings applied to them, in place.

    Args:
        tree: As YAML has it.
        overrides: The settings, `key=value` where they are words.

    Raises:
        InvalidInput: A setting has another form, names no place, or sets what another one sets.
    """
    settings = read_settings(overrides)
    refuse_doubled(settings)
    for setting in settings:
        if setting.text is not None:
            _set(tree, setting.key, setting.text)
    return tree


def read_settings(overrides: Sequence[str | Setting]) -> list[Setting]:
    """Settings, some of which are still words.

    Args:
        overrides: They, `key=value` where they are words.

    Raises:
        InvalidInput: A word has another form.
    """
    return [Setting.read(each) if isinstance(each, str) else each for each in overrides]


def refuse_doubled(settings: Sequence[Setting]) -> None:
    """Refuse a value that is set twice, the same or not, as one of the two would be lost.

    Whoever sets a mapping sets all that is in it.

    Args:
        settings: From all places where something is set.

    Raises:
        InvalidInput: Two of them set one thing.
    """
    for i, second in enumerate(settings):
        for first in settings[:i]:
            if f"{first.key}.".startswith(f"{second.key}.") or second.key.startswith(
                f"{first.key}."
            ):
                key = max(first.key, second.key, key=len)
                raise InvalidInput(f"`{key}` must be set once; got {first.said} and {second.said}")


def build(schema: type[Schema], tree: Any) -> Schema:
    """Make a dataclass from nested mappings and lists, with errors that name the key.

    Args:
        schema: The dataclass.
        tree: As YAML has it.

    Raises:
        InvalidInput: See `load_scenario`.
    """
    try:
        built: Schema = _adapter(schema).validate_python(tree)
    except ValidationError as invalid:
        raise InvalidInput(_describe(invalid, schema)) from None
    _refuse_truth_as_number(tree, built)
    return built


def _refuse_truth_as_number(tree: Any, built: Any, place: str = "") -> None:
    """Refuse true and false where a number is meant, which pydantic takes for 1 and 0.

    Args:
        tree: As YAML has it.
        built: What was made of it.
        place: Its key, with a dot behind it.
    """
    if isinstance(tree, bool):
        number = isinstance(built, (int, float)) and not isinstance(built, bool)
        require(not number, place[:-1], "be a number", str(tree).lower())
    elif isinstance(tree, dict):
        for key, value in tree.items():
            _refuse_truth_as_number(value, getattr(built, str(key), None), f"{place}{key}.")
    elif isinstance(tree, list) and isinstance(built, Sequence):
        for index, pair in enumerate(zip(tree, built, strict=False)):
            _refuse_truth_as_number(*pair, f"{place}{index}.")


# Reading the types of a schema takes far longer than building from it, and a study builds hundreds.
@lru_cache(maxsize=32)
def _adapter(schema: type[Schema]) -> TypeAdapter[Schema]:
    return TypeAdapter(with_config(NO_OTHER_KEYS)(schema))


def _set(tree: dict[str, Any], key: str, value: str) -> None:
    """Apply one setting to nested mappings and lists."""
    *parents, last = key.split(".")
    node: Any = tree
    for parent in parents:
        if isinstance(node, list):
            node = node[_position(node, parent, key)]
        else:
            node = node.setdefault(parent, {})
        if not isinstance(node, (dict, list)):
            raise InvalidInput(f"`--set` must name a key of the scenario; got {key}")
    try:
        parsed = read_yaml(value)
    except yaml.YAMLError:
        raise InvalidInput(f"`--set` must give `{key}` a YAML value; got {value}") from None
    if isinstance(node, list):
        node[_position(node, last, key)] = parsed
    else:
        node[last] = parsed


def _position(node: list[Any], index: str, key: str) -> int:
    """The place in a list that a part of a dotted key names."""
    if not (index.isdigit() and int(index) < len(node)):
        raise InvalidInput(f"`--set` must name an entry below {len(node)} in {key}; got {index}")
    return int(index)


def _describe(invalid: ValidationError, schema: type) -> str:
    """The first error, as one line that names the key and the value."""
    first = invalid.errors()[0]
    key = ".".join(str(part) for part in first["loc"])
    rule = first.get("ctx", {}).get("error")
    if isinstance(rule, WrongQuantity):
        return f"`{key}` must {rule.requirement}; got {rule.got}"
    if isinstance(rule, InvalidInput):
        # The dataclass has named its own field: put the path before it.
        message = str(rule)
        return f"`{key}.{message[1:]}" if key and message.startswith("`") else message
    if first["type"] == "unexpected_keyword_argument":
        refused = f"`{key}` must be a key of the scenario; got {first['input']!r}"
        keys = _keys_beside(schema, first["loc"])
        return f"{refused} (there are {', '.join(keys)})" if keys else refused
    if first["type"] == "missing":
        # What came is all that stands beside it.
        return f"`{key}` must be given; got nothing"
    wanted = first["msg"].removeprefix("Input should be ")
    return f"`{key}` must be {wanted[0].lower()}{wanted[1:]}; got {first['input']!r}"


def _keys_beside(schema: Any, place: Sequence[int | str]) -> list[str]:
    """The keys that a scenario has where one was named that it has not."""
    for part in place[:-1]:
        if isinstance(part, int):
            schema = next(iter(get_args(schema)), None)
        else:
            schema = get_type_hints(schema).get(part) if is_dataclass(schema) else None
    return [each.name for each in fields(schema)] if is_dataclass(schema) else []
