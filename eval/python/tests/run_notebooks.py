"""Every notebook is executed from its first cell to its last, in an empty folder, with the package that is installed (test_install.py).
With SEXTANT_NOTEBOOKS=DIR they are kept there with what they print."""

import os
import pathlib
import sys
import tempfile
import unittest

try:
    import ipykernel  # noqa: F401
    import matplotlib  # noqa: F401
    import nbclient
    import nbformat
except ImportError as missing:
    print(f"notebooks are not executed: {missing}; scripts/setup --python installs what they need")
    sys.exit(77)

NOTEBOOKS = pathlib.Path(__file__).resolve().parent.parent / "notebooks"


class Notebooks(unittest.TestCase):
    def execute(self, name):
        notebook = nbformat.read(NOTEBOOKS / f"{name}.ipynb", as_version=4)
        nbformat.validate(notebook)
        self.assertFalse([cell for cell in notebook.cells if cell.get("outputs")], "stored without outputs")
        with tempfile.TemporaryDirectory() as folder:
            nbclient.NotebookClient(notebook, timeout=500, resources={"metadata": {"path": folder}}).execute()
        if keep := os.environ.get("SEXTANT_NOTEBOOKS"):
            nbformat.write(notebook, pathlib.Path(keep) / f"{name}.ipynb")
        return "".join(output.get("text", "") for cell in notebook.cells for output in cell.get("outputs", [])), notebook

    @staticmethod
    def pictures(notebook):
        return sum("image/png" in output.get("data", {}) for cell in notebook.cells for output in cell.get("outputs", []))

    def test_my_trajectory(self):
        text, notebook = self.execute("my_trajectory")
        self.assertEqual(self.pictures(notebook), 1)
        if os.environ.get("EVO_DATA"):
            self.assertIn("m is the largest difference", text)
        else:
            self.assertIn("made up: 1500 poses", text)

    def test_noise_in_a_data_loader(self):
        text, notebook = self.execute("noise_in_a_data_loader")
        self.assertIn("20 samples, equal in one process and in two", text)
        self.assertGreater(self.pictures(notebook), 0)

    def test_figure_of_the_paper(self):
        text, notebook = self.execute("figure_of_the_paper")
        self.assertIn("24 cases", text)
        self.assertGreater(self.pictures(notebook), 0)

    def test_my_estimator_under_noise(self):
        text, notebook = self.execute("my_estimator_under_noise")
        self.assertIn("24 cases", text)
        self.assertEqual(self.pictures(notebook), 2)

    def test_all_are_tested(self):
        tested = {name.removeprefix("test_") for name in dir(self) if name.startswith("test_")}
        self.assertEqual({path.stem for path in NOTEBOOKS.glob("*.ipynb")} - tested, set())


if __name__ == "__main__":
    unittest.main()
