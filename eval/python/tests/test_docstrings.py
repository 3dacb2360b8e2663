"""Every function of the package has a docstring with an example, every class and method one; the examples are run, in an empty
folder. The stubs of the compiled parts name what these hold."""

import ast
import doctest
import importlib
import inspect
import os
import pathlib
import sys
import tempfile
import unittest

import numpy

os.environ["MPLBACKEND"] = "Agg"
import sextant  # noqa: E402

FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE | doctest.IGNORE_EXCEPTION_DETAIL


def documented():
    """(name, object) of what a user calls."""
    for name in sextant.__all__:
        found = getattr(sextant, name)
        yield name, found
        if inspect.isclass(found):
            yield from ((f"{name}.{key}", value) for key, value in vars(found).items()
                        if inspect.isfunction(value) and not key.startswith("_"))


class Docstrings(unittest.TestCase):
    def test_all_have_one(self):
        for name, found in documented():
            self.assertTrue((found.__doc__ or "").strip(), f"{name} has no docstring")
            if inspect.isroutine(found) and "." not in name:
                self.assertIn(">>>", found.__doc__, f"{name} has no example")

    def test_examples(self):
        try:
            import matplotlib  # noqa: F401
            import pandas  # noqa: F401
        except ImportError as missing:
            self.skipTest(f"{missing}: scripts/setup --python")
        before, finder, runner = os.getcwd(), doctest.DocTestFinder(recurse=False), doctest.DocTestRunner(optionflags=FLAGS)
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            try:
                for name, found in documented():
                    for test in finder.find(found, name, module=False, globs={"sextant": sextant, "numpy": numpy}):
                        runner.run(test)
            finally:
                os.chdir(before)
        self.assertEqual(runner.summarize(verbose=False).failed, 0)
        self.assertGreater(runner.tries, 40)


class Stubs(unittest.TestCase):
    def test_name_what_there_is(self):
        for name in ("_core", "_files", "_inprocess"):
            module = importlib.import_module(f"sextant.{name}")
            stub = pathlib.Path(sextant.__file__).parent / f"{name}.pyi"
            nodes = ast.parse(stub.read_text(encoding="utf-8")).body
            named = {node.name for node in nodes if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
            named |= {node.target.id for node in nodes if isinstance(node, ast.AnnAssign)}
            self.assertEqual(named, {key for key in vars(module) if not key.startswith("__")}, name)
        self.assertTrue((pathlib.Path(sextant.__file__).parent / "py.typed").is_file())


class Shown(unittest.TestCase):
    def test_reprs_are_short_and_html_has_a_picture(self):
        run = sextant.run("synthetic:s18@0-3", estimator="motion_only")
        noise = sextant.Noise({"flow": {"epe_px": 1.0}})
        frame = noise.apply(seed=0, dataset="a", sequence="b", frame=0, flow=numpy.zeros((100, 100, 2)))
        path = numpy.tile(numpy.eye(4), (1000, 1, 1))
        path[:, 2, 3] = numpy.arange(1000)
        path[:, 0, 3] = numpy.sin(numpy.arange(1000) / 50)
        errors = sextant.evaluate_trajectory(path, path)
        compared = sextant.compare(run.out, run.out, only="accuracy")
        for result in (run, frame, sextant.Trajectory(path), errors, compared, sextant.align(path, path),
                       sextant.relative_errors(path, path), run.rows[0]):
            self.assertLess(len(repr(result)), 200, type(result))
            self.assertNotIn("\n", repr(result))
            self.assertIn("<table>", result._repr_html_())
        for result in (run, sextant.Trajectory(path), errors):
            self.assertIn("data:image/png;base64,", result._repr_html_())
        kept = run.out
        self.assertTrue((kept / "records.jsonl").is_file())
        del run
        self.assertFalse(kept.exists(), "a temporary folder lives as long as the result")

    def test_plots_do_not_average_over_sequences_and_kinds_of_noise(self):
        try:
            import matplotlib  # noqa: F401
            import pandas  # noqa: F401
        except ImportError as missing:
            self.skipTest(f"{missing}: scripts/setup --python")
        sources, delta = ["synthetic:s18@0-2", "synthetic:s01-turn@0-2"], {"depth": {"delta_d_px": 0.5}}
        run = sextant.run(sources, estimator="motion_only", noise=delta)
        records = run.records()
        lines = {line.get_label(): line.get_ydata()[0] for line in run.plot().lines}
        first = records[(records.body == "ego") & (records.frame == 1)].set_index("sequence").errors_Et_m
        for sequence in ("s18", "s01-turn"):
            self.assertEqual(lines[f"motion_only ego {sequence}"], first[sequence])
        grids = [{"parameter": "depth.delta_d_px", "levels": [0.1, 0.2]}, {"parameter": "flow.epe_px", "levels": [0.1, 0.2]}]
        plan = {"name": "p", "sources": sources, "estimators": ["motion_only"], "noise": grids, "seeds": 1}
        names = {line.get_label() for line in sextant.sweep(plan).plot().lines}
        self.assertEqual({name for name in names if "bound" not in name},
                         {f"motion_only {sequence} {grid['parameter']}" for sequence in ("s18", "s01-turn") for grid in grids})
        self.assertIn("bound s18 flow.epe_px", names)
        plan.update(sources=sources[:1], noise=grids[1])
        self.assertEqual([line.get_label() for line in sextant.sweep(plan).plot().lines], ["motion_only", "bound"])

    def test_a_bound_is_drawn_with_rms_errors_and_grids_are_named(self):
        try:
            import matplotlib  # noqa: F401
            import pandas  # noqa: F401
        except ImportError as missing:
            self.skipTest(f"{missing}: scripts/setup --python")
        flow = {"parameter": "flow.epe_px", "levels": [0, 0.1, 0.2]}
        plan = {"name": "p", "sources": ["synthetic:s18@0-3"], "estimators": ["motion_only"], "noise": flow, "seeds": 3}
        sweep = sextant.sweep(plan)
        ax = sweep.plot()
        self.assertEqual((ax.get_xlabel(), ax.get_ylabel()), ("flow.epe_px", "RMS of E_t [m]"))
        records = sweep.records()
        records = records[(records.body == "ego") & (records.level == 0.2)]
        for line, column in zip(ax.lines, (records.errors_Et_m, records.bound_Et_m), strict=True):
            self.assertAlmostEqual(line.get_ydata()[-1], (column ** 2).mean() ** 0.5, places=12)
        self.assertEqual(sweep.plot("epe_initial_px").get_ylabel(), "mean epe initial [px]", "without a bound")
        with self.assertRaisesRegex(sextant.Error, "metric: expected one of ER_deg, Et_m.*, got 'Ev_kmh'"):
            sweep.plot("Ev_kmh")
        self.assertEqual(sweep.plot("Ev_kmh", body="object:1").get_ylabel(), "RMS of E_v [km/h]" if
                         "bound_Ev_kmh" in sweep.records() else "mean E_v [km/h]")
        bodies = {"background": {"epe_x_px": 1.3, "epe_y_px": 0.3}, "objects": {"epe_px": 0.4}}
        plan["seeds"] = 1
        plan["noise"] = [{"parameter": "flow.scale", "levels": [0.5, 1], "base": {"flow": {"bodies": bodies}}},
                         {"parameter": "scale", "levels": [0.5, 1], "base": {"profile": "pwc_net_kitti03"}},
                         {"parameter": "depth.delta_d_px", "levels": [0, 0.1]},
                         {"parameter": "depth.delta_d_px", "levels": [0.1, 0.2], "base": {"flow": {"epe_px": 0.5}}}]
        ax = sextant.sweep(plan).plot()
        self.assertEqual(ax.get_xlabel(), "level")
        lines = {line.get_label(): len(line.get_xdata()) for line in ax.lines if "bound" not in line.get_label()}
        self.assertEqual(lines, {"motion_only flow.scale": 2, "motion_only scale": 2, "motion_only depth.delta_d_px with none": 2,
                                 "motion_only depth.delta_d_px with flow 0.5 px": 2})

    def test_results_with_arrays_can_be_compared(self):
        path = numpy.tile(numpy.eye(4), (5, 1, 1))
        path[:, 2, 3] = range(5)
        for make in (lambda: sextant.align(path, path, "none"), lambda: sextant.relative_errors(path, path),
                     lambda: sextant.Bound(numpy.eye(6), None), lambda: sextant.Estimate(numpy.eye(4))):
            one, other = make(), make()
            self.assertTrue(one == one)
            self.assertFalse(one == other)

    def test_what_plot_refuses(self):
        path = numpy.tile(numpy.eye(4), (5, 1, 1))
        for plane in ("x", "xyz", "xw"):
            with self.assertRaisesRegex(sextant.Error, "plane: expected"):
                sextant.Trajectory(path).plot(plane=plane)
        with self.assertRaisesRegex(sextant.Error, "ax: expected 2 axes"):
            sextant.evaluate_trajectory(path, path).plot(ax=3)
        with self.assertRaisesRegex(sextant.Error, "ax: expected 1 axes"):
            sextant.Trajectory(path).plot(ax=3)

    def test_without_matplotlib(self):
        hidden = {name: sys.modules.pop(name) for name in list(sys.modules) if name.split(".")[0] == "matplotlib"}
        sys.modules["matplotlib"] = None
        try:
            path = sextant.Trajectory(numpy.tile(numpy.eye(4), (3, 1, 1)))
            self.assertNotIn("<img", path._repr_html_())
            with self.assertRaisesRegex(sextant.Error, "python3-matplotlib"):
                path.plot()
        finally:
            del sys.modules["matplotlib"]
            sys.modules.update(hidden)


if __name__ == "__main__":
    unittest.main()
