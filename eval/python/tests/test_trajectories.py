"""Errors of paths: those of `sextant evaluate ego` to 1e-12."""

import dataclasses
import itertools
import os
import pathlib
import tempfile
import unittest

import numpy

os.environ["MPLBACKEND"] = "Agg"
import sextant  # noqa: E402
from paths import motion, path, quaternion, write_kitti  # noqa: E402

RELATIONS = ["trans_part", "rot_part", "angle_deg", "angle_rad", "full", "point_distance"]
ALIGNMENTS = ["none", "origin", "se3", "sim3", "scale"]


class AsTheProgram(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.reference, cls.estimate = path(), path(noise=1.0)
        cls.files = [pathlib.Path(cls.folder.name) / name for name in ("gt.txt", "est.txt")]
        write_kitti(cls.files[0], cls.reference)
        write_kitti(cls.files[1], cls.estimate)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def program(self, **flags):
        return sextant.evaluate_ego(*self.files, format="kitti", **flags)

    def same(self, errors, by_program):
        self.assertEqual(len(errors), by_program.n)
        for name, value in dataclasses.asdict(sextant.statistics(errors)).items():
            expected = getattr(by_program.statistics, name)
            self.assertLessEqual(abs(value - expected), 1e-12 * max(1, abs(expected)), name)

    def test_absolute(self):
        for relation, align in itertools.product(RELATIONS, ALIGNMENTS):
            with self.subTest(relation=relation, align=align):
                errors = sextant.absolute_errors(self.estimate, self.reference, relation=relation, align=align)
                self.same(errors, self.program(relation=relation, align=align))

    def test_relative(self):
        for relation, (delta, all_pairs) in itertools.product(
                RELATIONS + ["point_distance_error_ratio"],
                [("1f", False), ("7f", True), ("10m", False), ("10m", True), ("5deg", False), ("0.1rad", False)]):
            with self.subTest(relation=relation, delta=delta, all_pairs=all_pairs):
                found = sextant.relative_errors(self.estimate, self.reference, relation=relation, delta=delta,
                                                all_pairs=all_pairs)
                self.same(found.errors, self.program(relation=relation, rpe=delta, all_pairs=all_pairs))
                self.assertTrue((found.pairs[:, 0] < found.pairs[:, 1]).all())

    def test_alignment_and_first_poses(self):
        by_program = self.program(align="sim3", n_to_align=50)
        found = sextant.align(self.estimate, self.reference, "sim3", n_to_align=50)
        numpy.testing.assert_allclose(found.transform, by_program.details["alignment"], rtol=0, atol=1e-12 * 400)
        self.same(sextant.absolute_errors(found.poses, self.reference), by_program)

    def test_yaw(self):
        by_program = self.program(align="yaw", up="-y")
        self.same(sextant.absolute_errors(self.estimate, self.reference, align="yaw", up=(0, -1, 0)), by_program)

    def test_per_frame_and_kitti_odometry(self):
        details = self.program().details
        inverse = numpy.linalg.inv
        steps = [inverse(poses[:-1]) @ poses[1:] for poses in (self.estimate, self.reference)]
        Et, ER = sextant.pose_change_errors(*steps)
        self.assertAlmostEqual(Et.mean(), details["per_frame"]["Et_m"]["mean"], delta=1e-12)
        self.assertAlmostEqual(ER.mean(), details["per_frame"]["ER_deg"]["mean"], delta=1e-12)
        whole, *by_length = sextant.kitti_odometry(self.estimate, self.reference)
        by_program = details["kitti_odometry"]
        self.assertEqual(whole.n, by_program["n"])
        self.assertAlmostEqual(whole.translation_percent, by_program["translation_percent"], delta=1e-12)
        self.assertAlmostEqual(whole.rotation_deg_per_m, by_program["rotation_deg_per_m"], delta=1e-12)
        self.assertEqual([row.n for row in by_length if row.n], [row["n"] for row in by_program["by_length"]])
        self.assertIsNone(by_length[-1].translation_percent)

    def test_by_time(self):
        stamps = 100.0 + 0.1 * numpy.arange(len(self.reference))
        kept = numpy.arange(3, len(stamps), 2)
        late = stamps[kept] + 0.004
        rows, of_estimate = sextant.associate(stamps, late)
        numpy.testing.assert_array_equal(rows, kept)
        files = []
        for name, poses, times in (("gt", self.reference, stamps), ("est", self.estimate[kept], late)):
            files.append(pathlib.Path(self.folder.name) / f"{name}.tum")
            files[-1].write_text("".join(
                " ".join(repr(float(x)) for x in [t, *pose[:3, 3], *quaternion(pose[:3, :3])]) + "\n"
                for t, pose in zip(times, poses)))
        by_program = sextant.evaluate_ego(*files, format="tum", rpe="2s", all_pairs=True, align="se3")
        matched = self.estimate[kept][of_estimate]
        found = sextant.relative_errors(matched, self.reference[rows], delta="2s", all_pairs=True, align="se3",
                                        stamps=late[of_estimate])
        self.assertEqual(by_program.n_matched, len(rows))
        self.same(found.errors, by_program)


class Kinds(unittest.TestCase):
    """Lists, other floats and strides give the numbers of float64."""

    def test_all_are_taken(self):
        estimate, reference = path(30, noise=1.0), path(30)
        wanted = sextant.absolute_errors(estimate, reference, align="se3")
        wide = numpy.zeros((60, 4, 4))
        wide[::2] = estimate
        for other in (estimate.tolist(), estimate.astype(">f8"), wide[::2], numpy.asfortranarray(estimate), sextant.Trajectory(estimate)):
            numpy.testing.assert_array_equal(sextant.absolute_errors(other, reference, align="se3"), wanted)
        single = sextant.absolute_errors(estimate.astype(numpy.float32), reference, align="se3")
        self.assertLess(numpy.abs(single - wanted).max(), 1e-4)


class Trajectories(unittest.TestCase):
    def test_become_arrays_by_value(self):
        poses, stamps = path(20, noise=1.0), numpy.cumsum(numpy.random.default_rng(2).uniform(0.2, 1.8, 20))
        made = sextant.Trajectory(poses, stamps, numpy.arange(5, 25))
        lists = sextant.Trajectory(poses.tolist(), stamps.tolist(), list(range(5, 25)))
        self.assertEqual(repr(made), repr(lists))
        for name in ("poses", "stamps", "frames"):
            numpy.testing.assert_array_equal(getattr(made, name), getattr(lists, name))
        try:
            import pandas
        except ImportError:
            self.skipTest("pandas is not installed")
        wanted = sextant.evaluate_trajectory(made, sextant.Trajectory(path(20), stamps), delta="3s")
        other = sextant.Trajectory(poses, pandas.Series(stamps, index=numpy.arange(20) + 5))
        found = sextant.evaluate_trajectory(other, sextant.Trajectory(path(20), pandas.Series(stamps)), delta="3s")
        numpy.testing.assert_array_equal(found.pairs, wanted.pairs)

    def test_its_arrays_are_its_own(self):
        poses, stamps, frames = path(4), 0.1 * numpy.arange(4), numpy.arange(4)
        made = sextant.Trajectory(poses, stamps, frames)
        poses[:, 0, 3] += 100
        stamps[0] = 50
        frames[0] = 3
        numpy.testing.assert_array_equal(made.poses, path(4))
        self.assertEqual((made.stamps[0], made.frames[0]), (0, 0))
        for array in (made.poses, made.positions, made.stamps, made.frames):
            with self.assertRaisesRegex(ValueError, "read-only"):
                array[0] = 0

    def test_empty_ones_are_shown(self):
        self.assertEqual(repr(sextant.Trajectory(numpy.empty((0, 4, 4)), stamps=[])), "Trajectory(poses: 0, length: 0 m)")

    def test_refused(self):
        poses = path(4)
        for words, arguments in (("poses: expected an array with shape (n, 4, 4), got shape (4, 3, 4)", {"poses": poses[:, :3]}),
                                 ("poses: expected an array with shape (n, 4, 4), got none", {"poses": None}),
                                 ("poses: expected finite numbers, got others in 4 of 4 poses, first in poses[0]", {"poses": poses * numpy.nan}),
                                 ("stamps: expected 4 numbers, one per pose, got shape (3,)", {"stamps": [0, 1, 2]}),
                                 ("stamps: expected finite numbers, got nan", {"stamps": [0, 1, numpy.nan, 3]}),
                                 ("stamps: expected each above the one before, got 1 after 2 at [2]", {"stamps": [0, 2, 1, 3]}),
                                 ("stamps: expected each above the one before, got 2 after 2", {"stamps": [0, 1, 2, 2]}),
                                 ("frames: expected each above the one before, got 1 after 1 at [2]", {"frames": [0, 1, 1, 2]}),
                                 ("frames: expected whole numbers", {"frames": [0, 1, 1.5, 2]}),
                                 ("frames: expected whole numbers from 0 to 1000000000, got 2147483647 at [3]", {"frames": [0, 1, 2, 2**31 - 1]}),
                                 ("frames: expected whole numbers from 0 to 1000000000, got -1 at [0]", {"frames": [-1, 0, 1, 2]}),
                                 ("poses: expected rigid motions [R t; 0 0 0 1], got the last row 0 0 0 0 at [0]", {"poses": 0 * poses}),
                                 ("poses: expected rigid motions [R t; 0 0 0 1], got a rotation part", {"poses": poses * [[[2], [2], [2], [1]]]}),
                                 ("has_rotations: expected True or False, got 'no' of type str", {"has_rotations": "no"}),
                                 ("truth: expected a sextant.Trajectory or None, got 5 of type int", {"truth": 5})):
            with self.assertRaises(sextant.Error) as caught:
                sextant.Trajectory(**{"poses": poses, **arguments})
            self.assertIn(words, str(caught.exception))


class Files(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_three_lines_are_the_command_to_the_last_digit(self):
        truth, found, stamps = path(400), path(400, noise=1.0), numpy.arange(400) * 0.1
        for format in ("kitti", "tum"):
            names = [self.folder / f"{kind}.{format}" for kind in ("truth", "found")]
            sextant.write_trajectory(names[0], truth, stamps=stamps, format=format)
            sextant.write_trajectory(names[1], found[3:] if format == "tum" else found,
                                     stamps=stamps[3:] + 0.003 if format == "tum" else stamps, format=format)
            for flags, mine in (({}, {}), ({"align": "se3"}, {"align": "se3"}), ({"align": "sim3", "relation": "angle_deg"},) * 2,
                                ({"rpe": "10m", "all_pairs": True}, {"delta": "10m", "all_pairs": True})):
                with self.subTest(format=format, **flags):
                    reference, estimate = sextant.read_trajectory(names[0], format), sextant.read_trajectory(names[1], format)
                    result = sextant.evaluate_trajectory(estimate, reference, **mine)
                    axes = result.plot()
                    by_program = sextant.evaluate_ego(*names, format=format, **flags)
                    self.assertEqual(result.statistics, by_program.statistics)
                    self.assertEqual((len(result.errors), result.unit), (by_program.n, by_program.unit))
                    self.assertEqual(len(axes[1].lines[0].get_xdata()), by_program.n)
                    axes[0].figure.clear()

    def both(self, estimate, reference, mine=None, **flags):
        """Returns what evaluate_ego and evaluate_trajectory give for two files: the result, or None where it is refused."""
        try:
            by_program = sextant.evaluate_ego(reference, estimate, **flags)
        except sextant.Error:
            by_program = None
        mine = {**flags, **(mine or {})}
        formats = [mine.pop("est_format", "auto"), mine.pop("ref_format", "auto")]
        if "rpe" in mine:
            mine["delta"] = mine.pop("rpe")
        try:
            found = sextant.evaluate_trajectory(sextant.read_trajectory(estimate, formats[0]),
                                                sextant.read_trajectory(reference, formats[1]), **mine)
        except sextant.Error:
            found = None
        self.assertEqual(found is None, by_program is None, flags)
        if found is not None:
            self.assertEqual((found.statistics, len(found.errors)), (by_program.statistics, by_program.n))
            self.assertEqual(len(found.warnings), len(by_program.warnings), (found.warnings, by_program.warnings))
        return found

    def test_frames_and_stamps_on_one_side(self):
        truth, found = path(20), path(20, noise=1.0)
        rows = [" ".join(map(repr, pose[:3].ravel().tolist())) for pose in found]
        (self.folder / "numbered").write_text("".join(f"{k + 1} {row}\n" for k, row in enumerate(rows)))
        (self.folder / "plain").write_text("".join(row + "\n" for row in rows))
        sextant.write_trajectory(self.folder / "rows", truth)
        sextant.write_trajectory(self.folder / "tum", truth, stamps=0.1 * numpy.arange(20))
        shifted = self.both(self.folder / "numbered", self.folder / "rows")
        self.assertEqual(len(shifted.errors), 19)
        self.assertIn("begins at frame 1", shifted.warnings[0])
        self.both(self.folder / "rows", self.folder / "numbered")
        self.assertIsNone(self.both(self.folder / "plain", self.folder / "tum"))
        self.assertIsNone(self.both(self.folder / "tum", self.folder / "plain"))
        self.both(self.folder / "numbered", self.folder / "tum")

    def test_few_matches_are_refused_or_reported(self):
        truth, found, stamps = path(100), path(100, noise=1.0), 0.1 * numpy.arange(100)
        sextant.write_trajectory(self.folder / "r", truth, stamps=stamps)
        for late, n in ((1000, None), (9.9, None), (9.5, None), (5, 50), (0, 100)):
            sextant.write_trajectory(self.folder / "e", found, stamps=stamps + late)
            result = self.both(self.folder / "e", self.folder / "r")
            self.assertEqual(n, result and len(result.errors))
            self.assertEqual(n == 50, any("only 50 of 100 poses" in text for text in result.warnings) if result else False)
        self.assertEqual(len(self.both(self.folder / "e", self.folder / "r", offset=0.2).errors), 98)
        with self.assertRaisesRegex(sextant.Error, "at least 3 are needed"):
            sextant.evaluate_trajectory(truth[:2], truth[:2])
        jump = truth.copy()
        jump[50:, 2, 3] += 500
        sextant.write_trajectory(self.folder / "j", jump, stamps=stamps)
        self.assertIsNone(self.both(self.folder / "e", self.folder / "j"))
        self.both(self.folder / "e", self.folder / "j", max_speed=1e4)
        self.both(self.folder / "e", self.folder / "r", {"up": (0, -1, 0)}, align="yaw", up="-y")
        self.both(self.folder / "e", self.folder / "r", align="sim3", n_to_align=20)
        with self.assertRaisesRegex(sextant.Error, "delta is needed"):
            sextant.evaluate_trajectory(truth, truth, all_pairs=True)

    def test_positions_only(self):
        truth, found = path(150), path(150, noise=1.0)
        sextant.write_trajectory(self.folder / "r", truth, stamps=0.1 * numpy.arange(150))
        (self.folder / "e").write_text("".join(f"{k / 10} {p[0]!r} {p[1]!r} {p[2]!r}\n" for k, p in enumerate(found[:, :3, 3].tolist())))
        allowed = 0
        for align, relation, rpe in itertools.product(["none", "origin", "se3"], RELATIONS, [None, "1f", "10m", "5deg"]):
            flags = {"align": align, "relation": relation, **({"rpe": rpe} if rpe else {})}
            with self.subTest(**flags):
                allowed += self.both(self.folder / "e", self.folder / "r", est_format="positions", **flags) is not None
        self.assertEqual(allowed, 2 * (2 + 2))
        positions, other = sextant.read_trajectory(self.folder / "e", "positions"), sextant.read_trajectory(self.folder / "r")
        for call in (lambda: sextant.absolute_errors(positions, other, relation="angle_deg"),
                     lambda: sextant.absolute_errors(other, positions, relation="angle_deg"),
                     lambda: sextant.relative_errors(positions, other),
                     lambda: sextant.relative_errors(positions, other, relation="point_distance", delta="5deg"),
                     lambda: sextant.align(positions, other, "origin"), lambda: sextant.kitti_odometry(positions, other),
                     lambda: sextant.write_trajectory(self.folder / "x", positions)):
            with self.assertRaisesRegex(sextant.Error, "needs rotations"):
                call()
        numpy.testing.assert_array_equal(sextant.absolute_errors(positions, other, align="se3"),
                                         sextant.evaluate_trajectory(positions, other, align="se3").errors)
        sextant.relative_errors(positions, other, relation="point_distance", delta="2s")  # stamps of the estimate
        for call in (lambda: sextant.pose_change_errors(positions, other), lambda: sextant.pose_change_errors(other, positions),
                     lambda: sextant.object_errors(positions, other), lambda: sextant.object_errors(other, positions),
                     lambda: sextant.object_errors(other, other, object_pose=positions),
                     lambda: sextant.object_errors(other, other, camera=(other, positions)),
                     lambda: sextant.object_errors(other, other, true_camera=(positions, other))):
            with self.assertRaisesRegex(sextant.Error, "needs rotations"):
                call()

    def test_paths_that_do_not_belong_together_by_index(self):
        poses, stamps = path(150), 0.1 * numpy.arange(150)
        both = [sextant.Trajectory(poses, stamps=stamps), sextant.Trajectory(poses, stamps=stamps + 0.1)]
        frames = [sextant.Trajectory(poses, frames=numpy.arange(150) + first) for first in (0, 3)]
        shorter = [sextant.Trajectory(poses[1:], stamps=stamps[1:]), both[0]]
        functions = (sextant.absolute_errors, sextant.relative_errors, sextant.align, sextant.kitti_odometry)
        for function, (estimate, reference) in itertools.product(functions, (both, both[::-1], frames, shorter)):
            with self.assertRaisesRegex(sextant.Error, r"evaluate_trajectory\(\) pairs poses .*associate"):
                function(estimate, reference)
        near = sextant.Trajectory(poses, stamps=stamps + 0.004)
        for function, reference in itertools.product(functions, (near, poses, frames[0])):
            function(both[0], reference)
        fast = [sextant.Trajectory(poses, stamps=0.005 * numpy.arange(150) + start) for start in (0, 0.005)]
        with self.assertRaisesRegex(sextant.Error, "stamps 0 and 0.005"):
            sextant.align(*fast)

    def test_statistics_in_a_notebook_have_their_units(self):
        html = sextant.evaluate_trajectory(path(20), path(20))._repr_html_()
        self.assertIn("<td>sse [m^2]</td>", html)
        self.assertIn("<td>rmse</td>", html)

    def test_written_and_read(self):
        truth = path(50)
        sextant.write_trajectory(self.folder / "a.txt", truth)
        numpy.testing.assert_array_equal(sextant.read_trajectory(self.folder / "a.txt").poses, truth)
        turns = numpy.array([motion(numpy.pi * axis / numpy.linalg.norm(axis), [1, 2, 3]) for axis in numpy.array(
            [[1.0, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [-1, 2, 3]])])  # half turns: the scalar part is 0
        for poses in (truth, turns):
            sextant.write_trajectory(self.folder / "b.txt", poses, stamps=numpy.arange(len(poses)) / 7)
            back = sextant.read_trajectory(self.folder / "b.txt")
            numpy.testing.assert_allclose(back.poses, poses, rtol=0, atol=1e-12)
            numpy.testing.assert_array_equal(back.stamps, numpy.arange(len(poses)) / 7)
        self.assertEqual(sorted(p.name for p in self.folder.iterdir()), ["a.txt", "b.txt"])

    def test_frame_numbers_are_written(self):
        frames = numpy.array([0, 5, 7, 9])
        sextant.write_trajectory(self.folder / "a.txt", sextant.Trajectory(path(4), frames=frames))
        back = sextant.read_trajectory(self.folder / "a.txt")
        numpy.testing.assert_array_equal(back.frames, frames)
        numpy.testing.assert_array_equal(back.poses, path(4))
        sextant.write_trajectory(self.folder / "a.txt", sextant.Trajectory(path(4), frames=numpy.arange(4)))
        self.assertIsNone(sextant.read_trajectory(self.folder / "a.txt").frames)

    def test_what_is_written_can_be_read(self):
        far = path(3)
        far[1, 2, 3] = -1e7
        sextant.write_trajectory(self.folder / "a.txt", sextant.Trajectory(far, frames=[0, 1, 10**9]))
        self.assertEqual(sextant.read_trajectory(self.folder / "a.txt").frames[2], 10**9)
        sextant.write_trajectory(self.folder / "a.txt", far, stamps=[-1e11, 0, 1e11])
        self.assertEqual(sextant.read_trajectory(self.folder / "a.txt").stamps[2], 1e11)
        for stamps in ([-1.1e11, 0, 1], [0, 1, 1.1e11]):
            with self.assertRaisesRegex(sextant.Error, r"stamps: expected seconds within 1e\+11 of 0, got -?110000000000 at \[[02]\]"):
                sextant.write_trajectory(self.folder / "a.txt", far, stamps=stamps)
        far[1, 2, 3] = -1.1e7
        for stamps in (None, [0, 1, 2]):
            with self.assertRaisesRegex(sextant.Error, r"trajectory: expected positions within 1e\+07 m of 0, got 11000000 at \[1\]"):
                sextant.write_trajectory(self.folder / "b.txt", far, stamps=stamps)
        self.assertFalse((self.folder / "b.txt").exists())

    def test_the_place_that_is_written(self):
        (self.folder / "taken").mkdir()
        os.mkfifo(self.folder / "pipe")
        for name in ("taken", "pipe"):
            with self.assertRaisesRegex(sextant.Error, f"{name}: cannot be written: it is not a regular file"):
                sextant.write_trajectory(self.folder / name, path(3))
        (self.folder / "link").symlink_to("target")
        before = os.umask(0o077)
        try:
            sextant.write_trajectory(self.folder / "link", path(3))
            sextant.write_trajectory(self.folder / ("x" * 250), path(3))
        finally:
            os.umask(before)
        self.assertTrue((self.folder / "link").is_symlink())
        self.assertEqual((self.folder / "target").stat().st_mode & 0o777, 0o600)
        self.assertEqual(sorted(p.name for p in self.folder.iterdir()), ["link", "pipe", "taken", "target", "x" * 250])

    def test_refused(self):
        (self.folder / "bad.txt").write_text("0 0 0 0 0 0 0 1\n1 nan 0 0 0 0 0 1\n")
        for call, words in ((lambda: sextant.read_trajectory(self.folder / "bad.txt", "tum"), "bad.txt:2"),
                            (lambda: sextant.read_trajectory(self.folder / "none.txt"), "none.txt"),
                            (lambda: sextant.read_trajectory(self.folder / "bad.txt", "tumm"), "tum"),
                            (lambda: sextant.write_trajectory(self.folder / "no/x", path(3)), "cannot be written"),
                            (lambda: sextant.write_trajectory(self.folder / "x", path(3), stamps=[1]), "stamps: expected 3"),
                            (lambda: sextant.write_trajectory(self.folder / "x", 2 * path(3)), "trajectory: expected rigid motions"),
                            (lambda: sextant.write_trajectory(self.folder / "x", None), "trajectory: expected"),
                            (lambda: sextant.write_trajectory(self.folder / "x", path(3), format="tum"), "stamps: expected 3"),
                            (lambda: sextant.write_trajectory(self.folder / "x", path(3), stamps=[0, numpy.nan, 1]), "finite"),
                            (lambda: sextant.write_trajectory(self.folder / "x", path(3), stamps=[0, 1, 1]), "each above"),
                            (lambda: sextant.read_flow(self.folder / "x.png"), "kitti or vkitti"),
                            (lambda: sextant.read_depth(self.folder / "x.png", "disparity256"), "bf")):
            with self.assertRaises(sextant.Error) as caught:
                call()
            self.assertIn(words, str(caught.exception))


class Refused(unittest.TestCase):
    def refuse(self, *parts, call=sextant.absolute_errors, estimate=None, **other):
        good = path(20)
        with self.assertRaises(sextant.Error) as caught:
            call(good if estimate is None else estimate, good, **other)
        for part in parts:
            self.assertIn(part, str(caught.exception))

    def test_bad_paths(self):
        good = path(20)
        bad = good.copy()
        bad[7, 0, 3] = numpy.nan
        self.refuse("estimate", "(n, 4, 4)", "got shape (20, 3, 4)", estimate=numpy.ascontiguousarray(good[:, :3]))
        self.refuse("estimate", "without a mask", estimate=numpy.ma.masked_invalid(bad))
        self.refuse("estimate", "expected numbers", estimate=good.astype(complex))
        self.refuse("estimate", "expected numbers", estimate=[["a"]])
        self.refuse("estimate", "rows differ", estimate=[[1.0], [1.0, 2.0]])
        self.refuse("estimate", "finite", "got nan at [7, 0, 3]", estimate=bad)
        self.refuse("estimate", "got 7", "20", estimate=good[:7].copy())
        self.refuse("estimate", "last row", estimate=good * 2)
        mirrored = good.copy()
        mirrored[3, :3, 0] *= -1
        self.refuse("estimate", "reflection at [3]", estimate=mirrored)
        mirrored[3, :3, :3] = 1.1 * good[3, :3, :3]
        self.refuse("estimate", "orthonormal", estimate=mirrored)

    def test_bad_words(self):
        self.refuse("relation", "did you mean 'trans_part'", relation="trans_par")
        self.refuse("relation", "relative_errors", relation="point_distance_error_ratio")
        self.refuse("alignment", "did you mean 'sim3'", align="sim4")
        self.refuse("up", align="yaw")
        self.refuse("up: expected 3 numbers, got 2", align="yaw", up=[0, 1])
        self.refuse("up: expected 3 numbers, got 5 of type int", align="yaw", up=5)
        self.refuse("up: expected a direction, got a vector of length 0", align="yaw", up=[0, 0, 0])
        self.refuse("tolerance: expected a finite number from 0 to 1, got inf", call=sextant.relative_errors, tolerance=10**400)
        for tolerance in (-0.1, 1.5):
            self.refuse(f"tolerance: expected a finite number from 0 to 1, got {tolerance}", call=sextant.relative_errors,
                        tolerance=tolerance, delta="2m", all_pairs=True)
        self.refuse("max_difference: expected a finite number of at least 0, got -1", call=sextant.evaluate_trajectory, max_difference=-1)
        with self.assertRaisesRegex(sextant.Error, "max_difference: expected a finite number of at least 0, got -1"):
            sextant.associate([0, 1], [0, 1], max_difference=-1)
        for call in (sextant.relative_errors, sextant.evaluate_trajectory):
            self.refuse("all_pairs: expected True or False, got 'False' of type str", call=call, delta="2m", all_pairs="False")
        self.refuse("pairs_from_reference: expected True or False, got 1", call=sextant.relative_errors, pairs_from_reference=1)
        self.assertEqual(len(sextant.relative_errors(path(20), path(20), all_pairs=numpy.True_).errors), 19)
        for call in (sextant.absolute_errors, sextant.relative_errors, sextant.evaluate_trajectory):
            for align in ("none", "origin"):
                self.refuse("n_to_align", f"'{align}'", call=call, n_to_align=5, align=align)
        for other in ({}, {"delta": "2m"}, {"all_pairs": True}):
            self.refuse("tolerance", "all_pairs=True", call=sextant.relative_errors, tolerance=0.2, **other)
        self.assertTrue(len(sextant.relative_errors(path(20), path(20), tolerance=0.9, all_pairs=True, delta="2m").errors))
        self.refuse("offset: needs time stamps", call=sextant.evaluate_trajectory, offset=0.1)
        self.refuse("max_difference: needs time stamps", call=sextant.evaluate_trajectory, max_difference=0.1)
        self.refuse("delta", call=sextant.relative_errors, delta="far")
        self.refuse("1000f", call=sextant.relative_errors, delta="1000f")
        self.refuse("stamps", call=sextant.relative_errors, delta="1s")
        self.refuse("stamps", "20", "got 3", call=sextant.relative_errors, delta="1s", stamps=numpy.arange(3.0))
        self.refuse("stamps", "ascending", call=sextant.relative_errors, delta="1s", stamps=-numpy.arange(20.0))
        still = numpy.tile(numpy.eye(4), (5, 1, 1))
        with self.assertRaises(sextant.Error):
            sextant.align(still, still, "se3")
        with self.assertRaisesRegex(sextant.Error, "errors: expected finite numbers, got nan at \\[1\\]"):
            sextant.statistics(numpy.array([1.0, numpy.nan]))


if __name__ == "__main__":
    unittest.main()
