"""Errors of object motions: those of `sextant evaluate objects` to 1e-12. The bound: a literal formula."""

import pathlib
import tempfile
import unittest

import numpy

import sextant
from paths import motion, path, quaternion

RATE = 10.0


def line(frame, *rest):
    """A line of a DynOSAM log: what is no matrix is written as it is."""
    values = [str(frame)]
    for value in rest:
        if isinstance(value, numpy.ndarray):
            values += [repr(float(x)) for x in [*value[:3, 3], *quaternion(value[:3, :3])]]
        else:
            values.append(str(value))
    return ",".join(values) + "\n"


class ObjectErrors(unittest.TestCase):
    def test_are_those_of_the_program(self):
        random = numpy.random.default_rng(3)
        true_camera, camera = path(40), path(40, noise=0.5)
        start = motion([0, 0.3, 0], [4, 1, 15])
        L = [start]
        for _ in range(39):
            L.append(L[-1] @ motion([0, 0.03, 0], [0.02, 0, 1.1]))
        L = numpy.array(L)
        H_true = L[1:] @ numpy.linalg.inv(L[:-1])
        noise = numpy.array([motion(0.02 * random.normal(size=3), 0.05 * random.normal(size=3)) for _ in H_true])
        H = L[:-1] @ (numpy.linalg.inv(L[:-1]) @ H_true @ L[:-1] @ noise) @ numpy.linalg.inv(L[:-1])
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            pose = "tx,ty,tz,qx,qy,qz,qw"
            both = f"{pose},{','.join('gt_' + key for key in pose.split(','))}\n"
            (folder / "m_object_motion_log.csv").write_text(
                "frame_id,object_id," + both + "".join(line(k + 1, 7, H[k], H_true[k]) for k in range(39)))
            (folder / "m_object_pose_log.csv").write_text(
                "frame_id,object_id," + both + "".join(line(k, 7, L[k], L[k]) for k in range(40)))
            (folder / "m_camera_pose_log.csv").write_text(
                "frame_id," + both + "".join(line(k, camera[k], true_camera[k]) for k in range(40)))
            out = folder / "report"
            result = sextant.evaluate_objects(folder, format="dynosam", rate=RATE, out=out)
            records = sextant.read(out)
        found = sextant.object_errors(H, H_true, object_pose=L[:-1].copy(), dt=1 / RATE,
                                      camera=(camera[:-1].copy(), camera[1:].copy()),
                                      true_camera=(true_camera[:-1].copy(), true_camera[1:].copy()))
        records = records[records.errors_Et_world_m.notna()]
        kept = records.frame.to_numpy() - 1  # an exact identity as truth is none: the camera's first pose
        self.assertGreaterEqual(len(records), 38)
        for key in ("Et_m", "ER_deg", "Et_world_m", "ER_world_deg", "Et_body_m", "ER_body_deg", "Ev_kmh"):
            expected = records["errors_" + key].to_numpy()
            difference = numpy.nanmax(numpy.abs(found[key][kept] - expected))
            self.assertLessEqual(difference, 1e-12 * max(1, numpy.nanmax(expected)), key)
            self.assertGreater(numpy.nanmean(expected), 1e-4, key)
        row = next(row for row in result.rows if row.labels["preset"] == "vdo_slam" and row.body == "7")
        self.assertEqual((row.n_truth, row.n_estimated), (39, 39))

    def test_a_path_gives_the_poses_of_the_object(self):
        H, L = path(5), path(5, seed=2)
        found, wanted = (sextant.object_errors(H, H, object_pose=each) for each in (sextant.Trajectory(L), L))
        numpy.testing.assert_array_equal(found["v_kmh"], wanted["v_kmh"])

    def test_refused(self):
        H = path(5)
        for parts, other in ((("object_pose", "expected 5", "got 3"), {"object_pose": H[:3].copy()}),
                             (("dt", "above 0", "got 0"), {"object_pose": H, "dt": 0.0}),
                             (("camera", "tuple"), {"camera": H}),
                             (("camera[1]", "expected 5", "got 4"), {"camera": (H, H[1:].copy())})):
            with self.assertRaises(sextant.Error) as caught:
                sextant.object_errors(H, H, **other)
            for part in parts:
                self.assertIn(part, str(caught.exception))


class TheBound(unittest.TestCase):
    def setUp(self):
        random = numpy.random.default_rng(5)
        self.camera = sextant.Camera(700.0, 710.0, 600.0, 180.0, 350.0)
        self.pixels = numpy.stack([random.uniform(0, 1200, 80), random.uniform(0, 360, 80)], axis=1)
        self.depth = random.uniform(6, 30, 80)
        self.T = motion([0.01, 0.03, 0.005], [0.1, 0.02, -0.9])

    def literal(self, sigma_flow, delta_d, focal_baseline):
        """I = sum J' S^-1 J, as crlb.h writes it."""
        c, information = self.camera, numpy.zeros((6, 6))
        for (u, v), z in zip(self.pixels, self.depth):
            ray = numpy.array([(u - c.cx) / c.fx, (v - c.cy) / c.fy, 1])
            q = self.T[:3, :3] @ (z * ray) + self.T[:3, 3]
            projection = numpy.array([[c.fx / q[2], 0, -c.fx * q[0] / q[2]**2], [0, c.fy / q[2], -c.fy * q[1] / q[2]**2]])
            cross = numpy.array([[0, -q[2], q[1]], [q[2], 0, -q[0]], [-q[1], q[0], 0]])
            J = projection @ numpy.hstack([numpy.eye(3), -cross])
            j = projection @ self.T[:3, :3] @ ray
            S = numpy.diag(numpy.square(sigma_flow)) + (z * z / focal_baseline * delta_d)**2 * numpy.outer(j, j)
            information += J.T @ numpy.linalg.solve(S, J)
        return numpy.linalg.inv(information)

    def flow(self):
        c = self.camera
        rays = numpy.stack([(self.pixels[:, 0] - c.cx) / c.fx, (self.pixels[:, 1] - c.cy) / c.fy, numpy.ones(80)], axis=1)
        q = (rays * self.depth[:, None]) @ self.T[:3, :3].T + self.T[:3, 3]
        return numpy.stack([c.fx * q[:, 0] / q[:, 2] + c.cx, c.fy * q[:, 1] / q[:, 2] + c.cy], axis=1) - self.pixels

    def bound(self, **other):
        given = {"flow_sigma_px": (0.5, 0.3), "delta_d_px": 0.2, **other}
        return sextant.motion_bound(self.camera, self.pixels, self.depth, self.flow(), self.T, **given)

    def test_is_the_literal_formula(self):
        numpy.testing.assert_allclose(self.bound().previous_depth, self.literal((0.5, 0.3), 0.2, 350.0), rtol=1e-9)
        numpy.testing.assert_allclose(self.bound(baseline_m=0.5).previous_depth, self.literal((0.5, 0.3), 0.2, 350.0),
                                      rtol=1e-9)
        self.assertIsNone(self.bound().both_depths)
        Et, ER = self.bound().rms()
        diagonal = numpy.diag(self.bound().previous_depth)
        self.assertAlmostEqual(Et, numpy.sqrt(diagonal[:3].sum()), places=12)
        self.assertAlmostEqual(ER, numpy.rad2deg(numpy.sqrt(diagonal[3:].sum())), places=12)

    def test_is_reached_by_least_squares_for_cameras_and_objects(self):
        """Linearised estimates X_estimate = exp(xi) X with the covariance of the bound have its RMS errors."""
        self.T = motion([0, 0.05, 0], [0.2, 0, -3])  # an oncoming car
        bound = self.bound()
        random = numpy.random.default_rng(1)
        xi = random.multivariate_normal(numpy.zeros(6), bound.previous_depth, 4000)
        estimates = numpy.array([motion(x[3:], x[:3]) @ self.T for x in xi])
        truth = numpy.tile(self.T, (len(xi), 1, 1))
        rms = {"object": sextant.pose_change_errors(estimates, truth),
               "camera": sextant.pose_change_errors(numpy.linalg.inv(estimates), numpy.linalg.inv(truth))}
        for body, (Et, ER) in rms.items():
            expected = bound.rms(body=body)
            self.assertAlmostEqual(numpy.sqrt((Et**2).mean()) / expected[0], 1, delta=0.04, msg=body)
            self.assertAlmostEqual(numpy.sqrt((ER**2).mean()) / expected[1], 1, delta=0.04, msg=body)
        self.assertGreater(abs(bound.rms(body="object")[0] / bound.rms()[0] - 1), 0.05)
        for arguments, words in (({"body": "car"}, "expected 'camera' or 'object', got 'car'"),
                                 ({"body": "object", "T": numpy.eye(4)}, "T: expected None with body='object'")):
            with self.assertRaisesRegex(sextant.Error, words):
                bound.rms(**arguments)

    def test_does_not_depend_on_the_values_of_the_flow(self):
        for other in ({}, {"correlation": [(40.0, 0.5)]}, {"depth_curr": self.depth.copy()}):
            expected = self.bound(**other)
            found = sextant.motion_bound(self.camera, self.pixels, self.depth, 1e6 + self.flow(), self.T, flow_sigma_px=(0.5, 0.3),
                                         delta_d_px=0.2, **other)
            numpy.testing.assert_array_equal(found.previous_depth, expected.previous_depth)
            numpy.testing.assert_array_equal(found.both_depths, expected.both_depths)

    def test_more_of_it(self):
        correlated = self.bound(correlation=[(40.0, 0.5)])
        self.assertNotAlmostEqual(correlated.rms()[0], self.bound().rms()[0], places=6)
        both = self.bound(depth_curr=self.depth.copy())
        self.assertLess(both.rms(both=True)[0], both.rms()[0])
        truth, off = self.T, self.T @ motion([0, 0.001, 0], [0.01, 0, 0])
        self.assertGreater(sextant.nees(off, self.bound().previous_depth, truth), 0)
        self.assertAlmostEqual(sextant.nees(truth, self.bound().previous_depth, truth), 0, places=9)

    def test_refused(self):
        for parts, other in ((("flow_sigma_px", "above 0", "got 0.0"), {"flow_sigma_px": (0.0, 1.0)}),
                             (("delta_d_px: expected a finite number of at least 0, got -1",), {"delta_d_px": -1}),
                             (("baseline_m: expected a finite number of at least 0, got -0.5",), {"baseline_m": -0.5}),
                             (("flow_sigma_px", "expected 2 numbers", "got 0.3 of type float"), {"flow_sigma_px": 0.3}),
                             (("flow_sigma_px", "expected 2 numbers", "got 3"), {"flow_sigma_px": (1, 1, 1)}),
                             (("correlation", "expected 2 numbers", "got 50"), {"correlation": (50, 0.7)}),
                             (("correlation", "expected a list", "got 5"), {"correlation": 5}),
                             (("correlation", "at most 1", "got 1.4"), {"correlation": [(50, 0.7), (20, 0.7)]}),
                             (("depth_curr", "above 0 m, or NaN", "got 0 at [0] and 79 more"), {"depth_curr": 0 * self.depth}),
                             (("depth_curr", "got -6"), {"depth_curr": numpy.append(self.depth[1:], -6.0)}),
                             (("depth_curr", "expected numbers"), {"depth_curr": self.depth.astype(complex)})):
            with self.assertRaises(sextant.Error) as caught:
                self.bound(**other)
            for part in parts:
                self.assertIn(part, str(caught.exception))
        with self.assertRaisesRegex(sextant.Error, "both: expected False"):
            self.bound().rms(both=True)
        with self.assertRaisesRegex(sextant.Error, "both: expected True or False, got 'False'"):
            self.bound().rms(both="False")
        flow = self.flow()
        self.flow = lambda: flow
        self.depth[4] = -2
        with self.assertRaisesRegex(sextant.Error, r"depth: expected depths above 0 m, got -2 at \[4\]"):
            self.bound()
        self.depth[4] = numpy.nan
        with self.assertRaisesRegex(sextant.Error, r"depth: expected finite numbers, got nan at \[4\]"):
            self.bound()


class Covariances(unittest.TestCase):
    def test_of_nees(self):
        truth, off = numpy.eye(4), motion([0, 0.01, 0], [0.1, 0, 0])
        upper = numpy.diag([1.0, 1, 1, 1e-8, 1e-8, 1e-8])
        upper[0, 3] = 0.9e-4
        whole = upper + numpy.triu(upper, 1).T
        self.assertGreater(sextant.nees(off, whole, truth), 0)
        for covariance, words in ((upper, r"symmetric matrix, got 9e-05 at \[0, 3\] and 0 at \[3, 0\]"), (upper.T, "symmetric"),
                                  (-numpy.eye(6), "positive semidefinite"), (numpy.diag([1, 1, 1, -1e-9, 1, 1]), "positive semidefinite"),
                                  (whole + numpy.triu(0.2 * upper, 1) + numpy.triu(0.2 * upper, 1).T, "positive semidefinite")):
            with self.assertRaisesRegex(sextant.Error, f"covariance: expected a {words}"):
                sextant.nees(off, covariance, truth)
            with self.assertRaisesRegex(sextant.Error, words):
                sextant.Bound(covariance, None).rms()
        self.assertIsNone(sextant.nees(off, numpy.diag([1, 1, 1, 0, 1, 1]), truth))
        whole[0, 3] *= 1 + 1e-9  # rounding
        self.assertGreater(sextant.nees(off, whole, truth), 0)


if __name__ == "__main__":
    unittest.main()
