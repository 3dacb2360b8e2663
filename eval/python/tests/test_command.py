"""The program from Python: typed results, progress, errors with the program's message."""

import copy
import gc
import json
import os
import pathlib
import pickle
import stat
import tempfile
import unittest

import numpy

import sextant

SOURCE = "synthetic:s18@0-4"


class Command(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.temporary.name)
        self.addCleanup(self.temporary.cleanup)

    def refuse(self, pattern, call, *arguments, **flags):
        with self.assertRaisesRegex(sextant.Error, pattern):
            call(*arguments, **flags)

    def test_run(self):
        seen = []
        run = sextant.run(SOURCE, out=self.folder / "a", noise=sextant.Noise({"flow": {"epe_px": 0.3}}), seeds=2,
                          options={"pipeline": {"max_object_distance_m": 20}}, progress=seen.append)
        self.assertEqual((run.preset, run.aggregate), ("paper", "mean"))
        ego = run.rows[0]
        self.assertEqual((ego.body, ego.labels["sequence"], ego.n_truth, ego.coverage_percent), ("ego", "s18", 8, 100.0))
        records = run.records()
        self.assertAlmostEqual(ego.metrics["Et_m"], records[records.body == "ego"].errors_Et_m.mean(), delta=1e-12)
        configuration = json.dumps(records.attrs["run"])
        self.assertIn('"max_object_distance_m": 20', configuration)
        self.assertTrue(seen)
        self.assertIsInstance(seen[-1], sextant.command.Progress)
        self.assertEqual(seen[-1].done, seen[-1].total)

    def test_a_plot_draws_the_errors_of_the_rows(self):
        """Object 6 is static by truth and estimated in some frames: the rows do not count it, and neither does the figure."""
        run = sextant.run("synthetic:s18", out=self.folder / "a", noise={"depth": {"delta_d_px": 0.2}, "flow": {"epe_px": 0.5}})
        records = run.records()
        self.assertGreater((records[records.body == "object:6"].errors_Et_m > 0).sum(), 0)
        axes = run.plot()
        self.assertEqual([line.get_label() for line in axes.lines],
                         [f"joint_flow {row.body}" for row in run.rows if row.n_estimated > 0])
        for line, row in zip(axes.lines, run.rows):
            self.assertAlmostEqual(numpy.mean(line.get_ydata()), row.metrics["Et_m"], delta=1e-12)  # no gap: every frame counts
        self.assertEqual(axes.get_title(), "synthetic s18\ndepth 0.2 px + flow 0.5 px")
        lines = (self.folder / "a" / "records.jsonl").read_text().splitlines()
        missing = [line for line in lines if not ('"body":"object:1"' in line and '"frame":5,' in line)]
        self.assertEqual(len(missing), len(lines) - 1)
        (self.folder / "a" / "records.jsonl").write_text("\n".join(missing) + "\n")
        drawn = run.plot().lines[1]
        self.assertEqual(drawn.get_xdata()[numpy.isnan(drawn.get_ydata())].tolist(), [5], "a gap stays a gap")

    def test_run_refused(self):
        out = self.folder / "a"
        self.refuse("did you mean 'joint_flow'", sextant.run, SOURCE, out=out, estimator="joint_flo")
        self.refuse("did you mean 'depth'", sextant.run, SOURCE, out=out, noise={"dept": {}})
        self.refuse("no-such", sextant.run, "vdo:no-such", out=out)
        self.refuse("sources: expected at least one", sextant.run, [], out=out)
        self.refuse("sources: expected no flag", sextant.run, "--help", out=out)
        self.refuse("seeds: expected 1 to", sextant.run, SOURCE, out=out, seeds=0)
        self.refuse("out: expected a path", sextant.run, SOURCE, out=3)
        self.refuse("out: expected a path", sextant.run, SOURCE, out="a\ud800")
        self.refuse("sources: expected a path", sextant.run, "vdo:\ud800", out=out)
        self.refuse("lone surrogate", sextant.run, SOURCE, out=out, noise='{"\ud800": 1}')
        self.refuse("progress: expected", sextant.run, SOURCE, out=out, progress=3)
        with self.assertRaises(sextant.ProgramError) as caught:
            sextant.run(SOURCE, out=out, preset="papr")
        self.assertEqual(caught.exception.exit_code, 2)
        self.assertFalse(out.exists())

    def test_switches_are_true_or_false(self):
        """bool("False") is True: a text would replace results."""
        out, plan = self.folder / "a", {"name": "p"}
        expected = "expected True or False"
        for value in ("False", "no", 0, None):
            for estimator in ("motion_only", lambda problem: problem.start):
                self.refuse(f"^force: {expected}", sextant.run, SOURCE, out=out, estimator=estimator, force=value)
            for estimators in (None, {"f": len}):
                for name in ("force", "reuse_stale"):
                    self.refuse(f"^{name}: {expected}", sextant.sweep, plan, out=out, estimators=estimators, **{name: value})
            for name in ("all_pairs", "estimate_offset", "inverse", "ref_inverse", "pairs_from_reference"):
                self.refuse(f"^{name}: {expected}", sextant.evaluate_ego, "a", "b", **{name: value})
        chooses = lambda problem: problem.start
        chooses.chooses_points = "no"
        self.refuse(f"chooses_points: {expected}, got 'no'", sextant.run, SOURCE, out=out, estimator=chooses)
        self.assertFalse(out.exists())
        for force in (numpy.False_, numpy.True_):
            sextant.run("synthetic:s18@0-1", out=out, estimator="motion_only", force=force, progress=numpy.False_)

    def test_texts_that_are_no_names_are_refused(self):
        """An empty value of a flag would take the next flag as its value; a zero byte would end a name."""
        out, empty = self.folder / "a", "expected a text, got an empty one"
        for name in ("out", "estimator", "preset", "data", "noise", "procedure"):
            self.refuse(f"{name}: {empty}", sextant.run, SOURCE, **{"out": out, name: ""})
        for name in ("out", "cache", "data"):
            self.refuse(f"{name}: {empty}", sextant.sweep, {"name": "p"}, **{"out": out, name: ""})
            self.refuse(f"{name}: {empty}", sextant.sweep, {"name": "p"}, estimators={"f": len}, **{"out": out, name: ""})
        for name in ("save_zip", "rpe", "offset"):
            self.refuse(f"{name}: {empty}", sextant.evaluate_ego, "a", "b", **{name: ""})
        self.refuse("^offset: expected a finite number, got 'true'", sextant.evaluate_ego, "a", "b", offset=True)
        for call in (sextant.read_trajectory, sextant.read_flow, sextant.read, sextant.run):
            self.refuse("expected a text without zero bytes", call, "a\0b")
            self.refuse(empty, call, "")
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_sweep_and_compare(self):
        plan = {"name": "t", "sources": [SOURCE], "estimators": ["motion_only"],
                "noise": {"parameter": "depth.delta_d_px", "levels": [0.1, 0.2]}, "seeds": 3}
        first = sextant.sweep(plan, out=self.folder / "a", cache=self.folder / "cache")
        self.assertEqual((first.cases, first.cases_before, len(first.records())), (6, 0, first.n_records))
        titles, rows = first._table()
        self.assertEqual(titles[:5], ["estimator", "body", "depth.delta_d_px", "n", "mean E_t [m]"])
        self.assertEqual([row[:4] for row in rows[:2]], [["motion_only", "ego", "0.1", 12], ["motion_only", "ego", "0.2", 12]])
        ego = first.records().query("body == 'ego' and level == 0.2").errors_Et_m.mean()
        self.assertEqual(rows[1][4], f"{ego:.4g}")
        file = self.folder / "plan.json"
        file.write_text(json.dumps(plan))
        again = sextant.sweep(file, out=self.folder / "a", cache=self.folder / "cache")
        self.assertEqual(again.n_records, first.n_records)
        same = sextant.compare(self.folder / "a", self.folder / "a", only="accuracy")
        self.assertTrue(same)
        self.assertEqual((same.verdict, same.exit_code), ("ok", 0))
        self.assertEqual((same.records, same.cases), (first.n_records, first.n_records))
        self.assertIn(f"records: {first.n_records}", repr(same))
        self.assertTrue(any(finding.row["metric"] == "Et_m" for finding in same.rows if finding.kind == "accuracy"))
        plan["noise"]["levels"] = [0.1, 2.0]
        plan["noise"]["base"] = {"flow": {"epe_px": 2}}
        sextant.sweep(plan, out=self.folder / "b", cache=self.folder / "cache")
        other = sextant.compare(self.folder / "a", self.folder / "b", only="accuracy")
        self.assertFalse(other)
        self.assertEqual(other.verdict, "invalid")
        missing = sextant.compare(self.folder / "a", self.folder / "no-such")
        self.assertEqual((missing.verdict, missing.exit_code), ("invalid", 2))
        self.assertIn("no-such: does not exist", missing.rows[0].row["subject"])
        self.refuse("^plan: sources: key .sources.: expected a list", sextant.sweep, {"sources": 3}, out=self.folder / "c")
        for estimators in (None, {"f": len}):
            self.refuse("^plan: sources: key 'sources' is missing$", sextant.sweep, {"name": "t"}, out=self.folder / "c",
                        estimators=estimators)
        python = {**plan, "estimators": ["python:f"]}
        self.refuse("^plan: estimators: unknown estimator 'python:f': .*estimators={'NAME': function}", sextant.sweep, python,
                    out=self.folder / "c")
        file.write_text(json.dumps(python))
        self.refuse("plan.json:1: .*estimators={'NAME': function}", sextant.sweep, file, out=self.folder / "c")
        self.refuse("estimator: .* got 'python:f': give the function itself", sextant.run, SOURCE, estimator="python:f")
        self.refuse("plan: expected a path", sextant.sweep, ["a.json", "b.json"], out=self.folder / "c")
        self.refuse("allow: expected a text or a list", sextant.compare, self.folder / "a", self.folder / "a", allow=5)

    def test_evaluate_ego(self):
        sextant.run(SOURCE, out=self.folder / "a")
        files = [self.folder / "a" / f"{name}_camera_tum.txt" for name in ("gt", "est")]
        evaluation = sextant.evaluate_ego(*files, align="se3", save_zip=self.folder / "evo.zip")
        self.assertEqual((evaluation.n, evaluation.n_matched, evaluation.unit), (5, 5, "m"))
        self.assertLess(evaluation.statistics.rmse, 0.1)
        self.assertTrue((self.folder / "evo.zip").is_file())
        self.assertIn("rmse: ", repr(evaluation))
        self.assertIn("measured: APE trans_part [m], align se3", repr(evaluation))
        shown = evaluation._repr_html_()
        self.assertIn(f"<td>rmse</td><td>{evaluation.statistics.rmse:.6g}</td>", shown)
        self.assertIn("<img", shown)
        self.assertNotIn("ErrorStatistics(", shown)
        self.assertNotIn("details", shown)
        alone = sextant.evaluate_ego(*files, rpe="2f")
        self.assertEqual(alone.measured, "RPE trans_part [m] over 2f, align none")
        by_call = sextant.evaluate_trajectory(*(sextant.read_trajectory(file) for file in reversed(files)), delta="2f")
        self.assertEqual(by_call.measured, alone.measured)
        self.assertEqual(by_call.plot()[1].get_title(), alone.measured)
        self.refuse("no-such.txt", sextant.evaluate_ego, files[0], self.folder / "no-such.txt")
        self.refuse("unknown argument 'aling': did you mean 'align'", sextant.evaluate_ego, *files, aling="se3")

    def test_several_estimates_and_lengths(self):
        turns = numpy.random.default_rng(1).normal(size=(30, 3))
        truth = numpy.tile(numpy.eye(4), (30, 1, 1))
        truth[:, :3, 3] = numpy.cumsum([0, 0, 1] + 0.1 * turns, axis=0)
        files = {}
        for name, off in (("truth", 0), ("a", 0.5), ("b", 2.0)):
            poses = truth.copy()
            poses[:, 0, 3] += off
            files[name] = self.folder / f"{name}.txt"
            sextant.write_trajectory(files[name], poses, stamps=0.1 * numpy.arange(30))
        alone = [sextant.evaluate_ego(files["truth"], files[name]) for name in "ab"]
        self.assertEqual([system.statistics for each in alone for system in each.systems], [each.statistics for each in alone])
        self.assertTrue(alone[0].warnings)
        both = sextant.evaluate_ego(files["truth"], [f"{name}={files[name]}" for name in "ab"])
        self.assertEqual((both.n, both.n_matched, both.statistics), (None, None, None))
        for system, one, name in zip(both.systems, alone, "ab"):
            self.assertEqual((system.name, system.n, system.n_matched, system.statistics, system.warnings),
                             (name, one.n, one.n_matched, one.statistics, one.warnings))
        self.assertEqual(len(both.warnings), sum(len(one.warnings) for one in alone))
        self.assertTrue(both.warnings[0].startswith("a: "))
        lengths = sextant.evaluate_ego(files["truth"], files["a"], rpe="1f,5f,900m")
        self.assertEqual((lengths.n, lengths.n_matched, lengths.statistics), (None, 30, None))
        self.assertEqual(list(lengths.lengths), ["1f", "5f", "900m"])
        self.assertIsNone(lengths.lengths["900m"])
        self.assertEqual(lengths.measured, "RPE trans_part [m] over 1f, 5f, 900m, align none")
        self.assertIn("rmse 900m: none", repr(lengths))
        self.assertIn("<th>900m</th>", lengths._repr_html_())
        self.assertEqual([tick.get_text() for tick in both.plot().get_xticklabels()], ["a", "b"])
        every = sextant.evaluate_ego(files["truth"], [f"system_{name}={files[name]}" for name in "ab"], rpe=["1f", "5f", "10m"])
        for text in (every.measured, every.systems[1].measured, every._table()[0][0], every.plot().get_title()):
            self.assertEqual(text, "RPE trans_part [m] over 1f, 5f, 10m, align none")
        self.assertIn("over 1f, 5f, 10m", repr(every))
        self.assertEqual(both.systems[0].measured, "APE trans_part [m], align none")
        texts = every.plot().get_xticklabels()
        self.assertEqual([text.get_text() for text in texts][:4], ["system_a 1f", "system_a 5f", "system_a 10m", "system_b 1f"])
        self.assertEqual({text.get_rotation() for text in texts}, {40}, "labels side by side would overlap")
        self.assertEqual(lengths.lengths["5f"], sextant.evaluate_ego(files["truth"], files["a"], rpe="5f").statistics)

    def test_lists_and_arrays_of_numbers_are_arguments_too(self):
        turns = numpy.random.default_rng(1).normal(size=(30, 3))
        path = numpy.tile(numpy.eye(4), (30, 1, 1))
        path[:, :3, 3] = numpy.cumsum([0, 0, 1] + 0.1 * turns, axis=0)
        files = [self.folder / name for name in ("truth.txt", "found.txt")]
        for file, shift in zip(files, (0, 1)):
            sextant.write_trajectory(file, path + shift * 0.01 * (numpy.arange(16) == 7).reshape(4, 4), stamps=0.1 * numpy.arange(30))
        camera = numpy.eye(4)
        camera[0, 3] = 0.1
        for ours, theirs in (({"rpe": ["1f", "2f"]}, {"rpe": "1f,2f"}), ({"rpe": ("5f",)}, {"rpe": "5f"}),
                             ({"align": "yaw", "up": (0, -1, 0)}, {"align": "yaw", "up": "-y"}),
                             ({"align": "yaw", "up": numpy.array([0.0, 0, 2])}, {"align": "yaw", "up": "0 0 2"}),
                             ({"body_from_camera": camera}, {"body_from_camera": "0.1 0 0"})):
            found, wanted = (sextant.evaluate_ego(*files, **flags) for flags in (ours, theirs))
            self.assertEqual((found.statistics, found.lengths), (wanted.statistics, wanted.lengths))

    def test_errors_name_arguments_instead_of_flags(self):
        path = numpy.tile(numpy.eye(4), (5, 1, 1))
        path[:, 2, 3] = range(5)
        here, later = (sextant.Trajectory(path, stamps=start + 0.1 * numpy.arange(5)) for start in (0, 100))
        for name, trajectory in (("a--rate.txt", here), ("b.txt", later)):
            sextant.write_trajectory(self.folder / name, trajectory)
        a, b, out = self.folder / "a--rate.txt", self.folder / "b.txt", self.folder / "out"
        (self.folder / "empty.txt").write_text("")
        sextant.run("synthetic:s18@0-1", estimator="motion_only", out=out)
        plan = {"name": "p", "sources": ["synthetic:s18@0-1"], "estimators": ["motion_only"], "seeds": 2,
                "noise": {"parameter": "depth.delta_d_px", "levels": [0.1]}}
        sextant.sweep(plan, out=self.folder / "sweep")
        other = {**plan, "seeds": 3, "estimators": ["python:f"]}
        for expected, call in (
                ("within max_difference=0.01 s.*give offset=-100", lambda: sextant.evaluate_trajectory(later, here)),
                ("use align='origin' or align='none'", lambda: sextant.evaluate_trajectory(here, here, align="se3")),
                ("use align='origin' or align='none'", lambda: sextant.absolute_errors(path, path, align="se3")),
                ("use method='origin' or method='none'", lambda: sextant.align(path, path)),
                ("a--rate.txt within max_difference=0.01 s.*give offset=-100", lambda: sextant.evaluate_ego(a, b)),
                ("align='yaw' and up go together", lambda: sextant.evaluate_ego(a, a, align="yaw")),
                ("^up: expected 3 numbers, got 2$", lambda: sextant.evaluate_ego(a, a, align="yaw", up=(0, 1))),
                ("which estimate_offset=True refines", lambda: sextant.evaluate_ego(a, b)),
                ("which estimate_offset=True of sextant.evaluate_ego refines", lambda: sextant.evaluate_trajectory(later, here)),
                ("give rate of sextant.evaluate_ego where rows", lambda: sextant.evaluate_trajectory(sextant.Trajectory(path), here)),
                ("give format, one of tum", lambda: sextant.read_trajectory(self.folder / "empty.txt")),
                ("^offset: expected a finite number", lambda: sextant.evaluate_ego(a, b, offset=True)),
                ("known: format, .*all_pairs, ", lambda: sextant.evaluate_ego(a, b, aling="se3")),
                ("rate=-1: must be finite", lambda: sextant.evaluate_objects(self.folder, format="dynosam", rate=-1)),
                ("pass force=True to replace", lambda: sextant.run("synthetic:s18@0-1", estimator="motion_only", out=out, seeds=2)),
                ("pass force=True to start over", lambda: sextant.sweep({**plan, "seeds": 3}, out=self.folder / "sweep")),
                ("pass force=True to start over",
                 lambda: sextant.sweep(other, out=self.folder / "sweep", estimators={"f": lambda problem: problem.start}))):
            self.refuse(expected, call)

    def test_errors_pass_between_processes(self):
        with self.assertRaises(sextant.ProgramError) as caught:
            sextant.run("synthetic:nope", out=self.folder / "a")
        again = pickle.loads(pickle.dumps(caught.exception))
        self.assertEqual((type(again), str(again), again.exit_code), (sextant.ProgramError, str(caught.exception), 2))

    def test_a_temporary_folder_exists_as_long_as_a_result(self):
        run = sextant.run("synthetic:s18@0-1", estimator="motion_only")
        child = os.fork()
        if child == 0:
            try:
                del run
                gc.collect()
            finally:
                os._exit(0)
        os.waitpid(child, 0)
        n, out = len(run.records()), run.out
        copies = [copy.copy(run), copy.deepcopy(run), pickle.loads(pickle.dumps(run))]
        del run
        while copies:
            self.assertEqual(len(copies[0].records()), n)
            del copies[0]
        self.assertFalse(out.exists())

    def test_the_program_is_found_or_named_in_an_error(self):
        known = os.environ["SEXTANT_PROGRAM"]
        self.addCleanup(os.environ.__setitem__, "SEXTANT_PROGRAM", known)
        os.environ["SEXTANT_PROGRAM"] = str(self.folder)
        self.refuse("SEXTANT_PROGRAM: expected the program", sextant.run, SOURCE, out=self.folder / "a")
        broken = self.folder / "broken"
        broken.write_text("#!/bin/sh\necho hello\n")
        broken.chmod(broken.stat().st_mode | stat.S_IXUSR)
        os.environ["SEXTANT_PROGRAM"] = str(broken)
        self.refuse("expected JSON on its standard output, got b'hello", sextant.run, SOURCE, out=self.folder / "a")
        broken.write_text("#!/bin/sh\nkill -9 $$\n")
        self.refuse("ended with -9", sextant.run, SOURCE, out=self.folder / "a")
        del os.environ["SEXTANT_PROGRAM"]
        self.assertTrue(sextant.program().endswith("bin/sextant"))  # beside the package of a build


if __name__ == "__main__":
    unittest.main()
