"""Estimators written in Python, in process."""

import concurrent.futures
import json
import pathlib
import tempfile
import unittest

import numpy

import sextant

SOURCE = "synthetic:s18@0-4"
NOISE = {"depth": {"delta_d_px": 0.2}, "flow": {"epe_px": 0.3}}


def keep_start(problem):
    """Returns the start, which is the motion of RANSAC or the propagated one."""
    return problem.start


def least_squares(problem):
    """Gauss-Newton on the inliers, as the example in C++ (eval/examples/own_estimator.cc)."""
    c, use = problem.camera, problem.inliers
    points, landed = problem.points()[use], (problem.pixels + problem.flow)[use]
    T = problem.start.copy()
    for _ in range(10):
        q = points @ T[:3, :3].T + T[:3, 3]
        x, y, z = q.T
        r = landed - numpy.stack([c.fx * x / z + c.cx, c.fy * y / z + c.cy], axis=1)
        zero = numpy.zeros_like(x)
        projection = numpy.stack([numpy.stack([c.fx / z, zero, -c.fx * x / z**2], 1),
                                  numpy.stack([zero, c.fy / z, -c.fy * y / z**2], 1)], axis=1)
        cross = numpy.stack([numpy.stack([zero, -z, y], 1), numpy.stack([z, zero, -x], 1), numpy.stack([-y, x, zero], 1)], 1)
        J = numpy.concatenate([projection, -projection @ cross], axis=2).reshape(-1, 6)
        hessian = J.T @ J
        xi = numpy.linalg.solve(hessian, J.T @ r.ravel())
        T = exponential(xi) @ T
    return sextant.Estimate(T, covariance=numpy.linalg.inv(hessian) * r.var(), iterations=10)


def exponential(xi):
    """Exponential of a twist [rho; omega] by its series; steps are small."""
    X = numpy.zeros((4, 4))
    X[:3, 3] = xi[:3]
    X[:3, :3] = [[0, -xi[5], xi[4]], [xi[5], 0, -xi[3]], [-xi[4], xi[3], 0]]
    T, term = numpy.eye(4), numpy.eye(4)
    for k in range(1, 16):
        term = term @ X / k
        T = T + term
    u, _, v = numpy.linalg.svd(T[:3, :3])
    T[:3, :3] = u @ v
    return T


class Estimators(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.folder = pathlib.Path(self.temporary.name)
        self.addCleanup(self.temporary.cleanup)
        self.count = 0

    def run_with(self, function, **other):
        self.count += 1
        return sextant.run(SOURCE, out=self.folder / f"run{self.count}", estimator=function, noise=NOISE, **other)

    def test_is_as_good_as_those_inside(self):
        mine = self.run_with(least_squares, seeds=2)
        inside = self.run_with("motion_only", seeds=2)
        self.assertEqual([row.body for row in mine.rows], [row.body for row in inside.rows])
        for a, b in zip(mine.rows, inside.rows):
            self.assertEqual(a.labels["estimator"], "least_squares")
            self.assertEqual((a.n_truth, a.n_estimated), (b.n_truth, b.n_estimated))
            self.assertEqual("Et_m" in a.metrics, "Et_m" in b.metrics)
            if "Et_m" in a.metrics:
                self.assertLess(a.metrics["Et_m"], 2.5 * b.metrics["Et_m"] + 0.01, a.body)
        records = mine.records()
        self.assertGreater(records.values_nees.notna().sum(), 10)
        self.assertTrue((self.folder / "run1" / "summary.csv").is_file())

    def test_results_that_mean_something_else_are_named(self):
        """Correct motions give no warning; the records hold the numbers that the function returned."""
        def changed(change):
            def estimator(problem):
                T = least_squares(problem).T_curr_prev
                return change(T)
            return estimator

        def centimetres(T):
            T[:3, 3] *= 100
            return T

        def right(T):
            return T
        source = "synthetic:s18@0-10"
        for change, expected in ((right, None), (centimetres, "look like centimetres"), (numpy.linalg.inv, "look inverted")):
            run = sextant.run(source, out=self.folder / f"planted_{change.__name__}", estimator=changed(change), noise=NOISE)
            sweep = sextant.sweep({"sources": [source], "estimators": ["python:e"], "seeds": 1,
                                   "noise": {"parameter": "depth.delta_d_px", "levels": [0.2]}},
                                  out=self.folder / f"sweep_{change.__name__}", estimators={"e": changed(change)})
            for message in (run.warnings, sweep.problems):
                if expected is None:
                    self.assertEqual(message, [])
                else:
                    self.assertTrue(any("estimated camera" in text and expected in text for text in message), (expected, message))

    def test_sees_measurements_alone(self):
        seen = []

        def look(problem):
            seen.append(problem)
            return problem.start

        self.run_with(look, jobs=1)
        names = {field for problem in seen for field in vars(problem)}
        self.assertEqual(names, {"camera", "pixels", "depth", "flow", "depth_curr", "start", "inliers", "noise"})
        problem = seen[0]
        n = len(problem.depth)
        self.assertEqual((problem.pixels.shape, problem.flow.shape, problem.inliers.dtype), ((n, 2), (n, 2), bool))
        self.assertEqual(problem.noise.flow_x_px, 0.3)
        self.assertGreater(problem.noise.inverse_depth_per_m, 0)
        self.assertGreater(len({len(p.depth) for p in seen}), 1, "the camera and objects")
        # The points carry the noise: with it the exact motion does not fit them.
        clean = sextant.run(SOURCE, out=self.folder / "clean", estimator=look, jobs=1)
        self.assertIsNone(seen[-1].noise)
        self.assertLess(clean.rows[0].metrics["Et_m"], 0.005)

    def test_jobs_and_repetition_give_the_same(self):
        def without_times(run):
            frame = run.records()
            return frame[[name for name in frame if not name.startswith("time_ms")]]
        first = without_times(self.run_with(keep_start, jobs=1, seeds=3))
        for jobs in (1, 3):
            again = without_times(self.run_with(keep_start, jobs=jobs, seeds=3))
            self.assertTrue(first.equals(again))

    def test_lists_and_other_floats_are_taken(self):
        expected = self.run_with(lambda problem: problem.start)
        for convert in (numpy.ndarray.tolist, lambda T: tuple(map(tuple, T)), lambda T: T.astype(numpy.float32), numpy.asfortranarray):
            with self.subTest(convert=convert):
                given = self.run_with(lambda problem: sextant.Estimate(convert(problem.start), covariance=numpy.eye(6).tolist(),
                                                                       inliers=problem.inliers.tolist()))
                bare = self.run_with(lambda problem: convert(problem.start))
                for run in (given, bare):
                    for a, b in zip(run.rows, expected.rows):
                        self.assertEqual((a.body, a.n_estimated), (b.body, b.n_estimated))
                        if "Et_m" in b.metrics:
                            self.assertAlmostEqual(a.metrics["Et_m"], b.metrics["Et_m"], delta=2e-6)  # float32 of a metre and more
        plan = {"name": "t", "sources": ["synthetic:s18@0-1"], "estimators": ["motion_only"], "seeds": numpy.int64(2),
                "noise": {"parameter": "depth.delta_d_px", "levels": numpy.array([0.1, 0.2], numpy.float32)}}
        self.assertEqual(sorted(sextant.sweep(plan).records().level.unique()), [0.1, 0.2])

    def test_statuses(self):
        run = self.run_with(lambda problem: "diverged" if len(problem.depth) > 1000 else problem.start)
        ego = run.rows[0]
        self.assertEqual((ego.n_truth, ego.n_estimated), (4, 0))
        self.assertIn("diverged", ego.other)

    def test_its_code_is_part_of_the_configuration(self):
        out = self.folder / "a"
        sextant.run(SOURCE, out=out, estimator=keep_start)
        configuration = json.dumps(sextant.read(out).attrs["run"])
        self.assertIn("keep_start", configuration)
        self.assertIn("function keep_start", configuration)
        self.assertRegex(sextant.read(out).attrs["run"]["fingerprints"]["keep_start"][0]["sha256"], "^[0-9a-f]{64}$")
        sextant.run(SOURCE, out=out, estimator=keep_start)  # the same again may replace it

        def keep_start_2(problem):
            return 1.0 * problem.start

        keep_start_2.__name__ = "keep_start"
        with self.assertRaisesRegex(sextant.Error, "another configuration|force"):
            sextant.run(SOURCE, out=out, estimator=keep_start_2)

    def test_errors_are_the_functions_own(self):
        def broken(problem):
            return {}["key"]
        with self.assertRaises(KeyError):
            self.run_with(broken, jobs=2, seeds=3)
        self.assertFalse((self.folder / "run1" / "records.jsonl").exists())
        for answer, message in ((numpy.eye(3), r"estimator <?lambda>?: T_curr_prev: .*\(4, 4\), got shape \(3, 3\)"),
                             (numpy.full((4, 4), numpy.nan), "T_curr_prev: expected finite numbers, got nan"),
                             (2 * numpy.eye(4), "rigid motion"), ("no", "diverged.*got 'no'"), (None, "got NoneType"),
                             (sextant.Estimate(numpy.eye(4), covariance=numpy.eye(5)), r"covariance: .*got shape \(5, 5\)"),
                             (sextant.Estimate(numpy.eye(4), covariance=numpy.tri(6)), "estimator <?lambda>?: covariance: .*symmetric"),
                             (sextant.Estimate(numpy.eye(4), covariance=-numpy.eye(6)), "covariance: .*positive semidefinite"),
                             (numpy.ma.masked_equal(numpy.eye(4), 0), "T_curr_prev: expected .* with a mask"),
                             (sextant.Estimate(numpy.eye(4), iterations=-1), "estimator <?lambda>?: iterations: expected 0 to"),
                             (sextant.Estimate(numpy.eye(4), iterations=2**40), "iterations: expected 0 to"),
                             (sextant.Estimate(numpy.eye(4), iterations=None), "iterations: expected a whole number"),
                             (sextant.Estimate(numpy.eye(4), inliers=numpy.ones(3, int)), r"give inliers\.astype\('bool'\)"),
                             (sextant.Estimate(numpy.eye(4), inliers=numpy.ones(3, bool)), "inliers: .*got shape")):
            with self.assertRaisesRegex(sextant.Error, message):
                self.run_with(lambda problem: answer)

    def test_errors_say_where(self):
        def broken(problem):
            if len(problem.depth) < 1000:
                raise KeyError("missing")
            return problem.start
        with self.assertRaises(KeyError) as caught:
            self.run_with(broken, jobs=2)
        if hasattr(caught.exception, "add_note"):
            self.assertRegex(caught.exception.__notes__[0], r"^estimator broken: raised for synthetic s18, seed 0, frame [1-4], object:\d+$")
        for answer in (numpy.eye(3), None, "no"):
            with self.assertRaisesRegex(sextant.Error, r"; returned for synthetic s18, seed 0, frame 3, ego$"):
                sextant.run("synthetic:s18@2-4", estimator=lambda problem: answer, jobs=1)

    def test_sweep_beside_those_inside(self):
        plan = {"name": "t", "sources": [SOURCE], "estimators": ["motion_only", "python:mine"],
                "noise": {"parameter": "depth.delta_d_px", "levels": [0.1, 0.2]}, "seeds": 2}
        done = sextant.sweep(plan, out=self.folder / "a", cache=self.folder / "cache", estimators={"mine": least_squares})
        self.assertEqual(done.cases, 8)
        records = done.records()
        self.assertEqual(set(records.estimator), {"motion_only", "mine"})
        again = sextant.sweep(plan, out=self.folder / "a", cache=self.folder / "cache", estimators={"mine": least_squares})
        self.assertEqual(again.cases_before, 8)
        with self.assertRaisesRegex(sextant.Error, "python:mine"):
            sextant.sweep(plan, out=self.folder / "b", cache=self.folder / "cache", estimators={"other": least_squares})

    def test_progress(self):
        with self.assertRaisesRegex(sextant.Error, "progress: expected True or False, because the estimator is a function"):
            self.run_with(keep_start, progress=print)
        with self.assertRaisesRegex(sextant.Error, "progress: expected True, False or a function, got 5"):
            self.run_with(keep_start, progress=5)
        with self.assertRaisesRegex(sextant.Error, "progress: expected"):
            sextant.sweep({"name": "t"}, out=self.folder / "a", estimators={"a": keep_start}, progress=print)

    def test_runs_in_threads_keep_their_functions(self):
        def shifted(metres):
            def estimator(problem):
                T = problem.start.copy()
                T[0, 3] += metres
                return T
            return estimator
        plan = {"name": "t", "sources": ["synthetic:s18@0-2"], "estimators": ["python:e"], "seeds": 2,
                "noise": {"parameter": "depth.delta_d_px", "levels": [0.1]}}

        def by_sweep(metres):
            records = sextant.sweep(plan, estimators={"e": shifted(metres)}, jobs=1).records()
            return records[records.body == "ego"].errors_Et_m.mean()

        def by_run(metres):
            return sextant.run("synthetic:s18@0-2", estimator=shifted(metres), jobs=1).rows[0].metrics["Et_m"]
        metres = [0, 10, 20, 30]
        for call in (by_sweep, by_run):
            with concurrent.futures.ThreadPoolExecutor(4) as pool:
                for expected, found in zip(metres, pool.map(call, metres)):
                    self.assertAlmostEqual(found, expected, delta=0.1)

    def test_a_run_inside_an_estimator_is_refused(self):
        def nested(problem):
            sextant.run(SOURCE, out=self.folder / "inner", estimator=keep_start)
        with self.assertRaisesRegex(sextant.Error, "outside of it"):
            self.run_with(nested, jobs=2)
        self.run_with(keep_start)  # the refusal leaves nothing behind

    def test_a_refused_sweep_leaves_no_function_behind(self):
        plan = {"name": "t", "sources": [SOURCE], "estimators": ["python:a"], "seeds": 2,
                "noise": {"parameter": "depth.delta_d_px", "levels": [0.1]}}
        with self.assertRaisesRegex(sextant.Error, "estimator b: expected a function"):
            sextant.sweep(plan, out=self.folder / "a", estimators={"a": keep_start, "b": 5})
        with self.assertRaisesRegex(sextant.Error, "python:a"):
            sextant.sweep(plan, out=self.folder / "a", estimators={"z": keep_start})
        with self.assertRaisesRegex(sextant.Error, "estimators: expected a dict"):
            sextant.sweep(plan, out=self.folder / "a", estimators=[keep_start])


if __name__ == "__main__":
    unittest.main()
