"""A Jupyter kernel that knows the wheel and the dependencies, and nothing of the repository."""

import json
import sys
from collections.abc import Callable
from pathlib import Path

import nbformat
import pytest
from jupyter_client.kernelspec import KernelSpecManager
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient

# Longest that one cell may take before it counts as stuck [s].
_STUCK = 300


@pytest.fixture(scope="session")
def kernel_specs(wheel_places, tmp_path_factory) -> KernelSpecManager:
    """Where the kernel "wheel" is described."""
    folder = tmp_path_factory.mktemp("kernels")
    start = folder / "start_kernel.py"
    start.write_text(
        f"import sys\n"
        f"sys.path += {wheel_places!r}\n"
        f"from ipykernel.kernelapp import launch_new_instance\n"
        f"launch_new_instance()\n"
    )
    spec = {
        "argv": [sys.executable, "-I", "-S", str(start), "-f", "{connection_file}"],
        "display_name": "wheel",
        "language": "python",
        # No history and no settings of whoever runs the tests.
        "env": {"IPYTHONDIR": str(folder / "ipython")},
    }
    (folder / "wheel").mkdir()
    (folder / "wheel" / "kernel.json").write_text(json.dumps(spec))
    return KernelSpecManager(kernel_dirs=[str(folder)])


@pytest.fixture
def execute(kernel_specs) -> Callable[[nbformat.NotebookNode, Path], None]:
    """A function that runs a notebook in a folder; a cell that fails raises, outputs are kept."""

    def run(notebook: nbformat.NotebookNode, folder: Path) -> None:
        manager = AsyncKernelManager(kernel_spec_manager=kernel_specs, kernel_name="wheel")
        resources = {"metadata": {"path": str(folder)}}
        client = NotebookClient(notebook, km=manager, timeout=_STUCK, resources=resources)
        # Without that the kernel of a manager of ours, half a gigabyte, would go on to the end.
        client.execute(cleanup_kc=True)

    return run
