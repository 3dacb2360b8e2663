#!/usr/bin/env python3
"""Tests of scripts/fetch_*: each script against a server on this machine, with small archives made here.

usage: scripts/fetch_test.py [TEST...]
"""

import fcntl
import hashlib
import os
import pty
import re
import shutil
import signal
import subprocess
import time
import unittest

from fetch_testing import (DEMO, HANGS_S, SCRIPTS, FetchCase, demo_archive, kitti_archives, noise, tar, vkitti1_archives,
                           vkitti2_archives, zip_of, zip_with_link)


class FetchTest(FetchCase):
    # ---- what is unpacked, per script

    def test_vkitti1_everything(self):
        self.server.files = vkitti1_archives()
        text = self.fetch("fetch_vkitti1", "--all")
        self.assertEqual(len(self.tree()), 4 * 4 * 2 + 3 * 4)
        self.assertTrue((self.out / "vkitti_1.3.1_motgt/0018_15-deg-left.txt").is_file())
        image = self.out / "vkitti_1.3.1_depthgt/0018/clone/00001.png"
        self.assertEqual(image.read_bytes(), b"depthgt 0018 clone 1" + noise(40000))
        self.assertIn("CC BY-NC-SA 3.0", text)
        self.assertIn(f"vkitti1:{self.out}#0018/clone", text)
        self.assertIn(hashlib.sha256(self.server.files["vkitti_1.3.1_rgb.tar"]).hexdigest(), text)
        self.assertEqual(self.leftovers(), ["lock", "placed"])

    def test_vkitti1_text_only_is_the_default_and_asks_for_text_only(self):
        self.server.files = vkitti1_archives()
        for arguments in (["--text-only"], []):
            shutil.rmtree(self.out, ignore_errors=True)
            self.server.requests.clear()
            self.fetch("fetch_vkitti1", *arguments)
            self.assertEqual({r.name for r in self.server.requests},
                             {"vkitti_1.3.1_extrinsicsgt.tar.gz", "vkitti_1.3.1_motgt.tar.gz"})
            self.assertEqual(len(self.tree()), 8)

    def test_vkitti1_sequences(self):
        self.server.files = vkitti1_archives()
        self.fetch("fetch_vkitti1", "--masks", "--objects", "--sequences", "0018/clone")
        self.assertEqual(self.tree(), [
            "vkitti_1.3.1_motgt/0018_clone.txt", "vkitti_1.3.1_scenegt/0018/clone/00000.png",
            "vkitti_1.3.1_scenegt/0018/clone/00001.png", "vkitti_1.3.1_scenegt/0018_clone_scenegt_rgb_encoding.txt"])
        self.fetch("fetch_vkitti1", "--masks", "--objects", "--sequences", "0001")
        self.assertEqual(len(self.tree()), 4 + 2 + 2 * 2 + 2)
        self.server.requests.clear()
        self.fetch("fetch_vkitti1", "--masks", "--objects", "--sequences", "0018/clone,0001/clone")
        self.assertEqual(self.server.requests, [])
        self.assertIn("holds nothing of 0020", self.fetch("fetch_vkitti1", "--masks", "--sequences", "0020", code=5))

    def test_vkitti2(self):
        self.server.files = vkitti2_archives()
        text = self.fetch("fetch_vkitti2", "--all")
        self.assertEqual(len(self.tree()), 5 * 2 * 2 + 2 * 6)
        self.assertTrue((self.out / "Scene18/clone/frames/forwardFlow/Camera_1/x_00000.png").is_file())
        self.assertTrue((self.out / "Scene18/clone/extrinsic.txt").is_file())
        self.assertIn(f"vkitti2:{self.out}#Scene18/clone", text)

    def test_vkitti2_accepts_a_folder_above_the_scenes(self):
        self.server.files["vkitti_2.0.3_rgb.tar"] = tar({"vkitti_2.0.3_rgb/Scene01/clone/frames/rgb/Camera_0/a": b"a"})
        self.fetch("fetch_vkitti2", "--rgb")
        self.assertEqual(self.tree(), ["Scene01/clone/frames/rgb/Camera_0/a"])

    def test_kitti_everything_but_the_test_set(self):
        self.server.files = kitti_archives()
        text = self.fetch("fetch_kitti_tracking", "--all")
        self.assertIn("oxts: unpack 18B", text)  # two files of 9 bytes, not that of testing/
        folders = {"/".join(name.split("/")[:2]) for name in self.tree()}
        self.assertEqual(folders, {f"training/{f}" for f in (
            "image_02", "image_03", "calib", "oxts", "label_02", "instances_txt", "instances")})
        self.assertIn(f"kitti:{self.out}#0003", text)

    def test_kitti_sequences(self):
        self.server.files = kitti_archives()
        self.fetch("fetch_kitti_tracking", "--text-only", "--left", "--sequences", "0003")
        self.assertEqual(self.tree(), [f"training/{f}" for f in (
            "calib/0003.txt", "image_02/0003/000000.png", "image_02/0003/000001.png", "instances_txt/0003.txt",
            "label_02/0003.txt", "oxts/0003.txt")])

    def test_kitti_masks_without_a_folder(self):
        self.server.files["instances_txt.zip"] = zip_of({"0003.txt": "a", "0005.txt": "b"})
        self.fetch("fetch_kitti_tracking", "--masks")
        self.assertEqual(self.tree(), ["training/instances_txt/0003.txt", "training/instances_txt/0005.txt"])
        self.assertEqual((self.out / "training/instances_txt").stat().st_mode & 0o500, 0o500)

    def test_sceneflow2015(self):
        self.server.files["data_scene_flow_calib.zip"] = zip_of({"training/calib_cam_to_cam/000002.txt": "c"})
        self.server.files["data_scene_flow.zip"] = zip_of({"training/image_2/000002_10.png": "i",
                                                           "testing/image_2/000002_10.png": "t"})
        self.fetch("fetch_sceneflow2015", "--all")
        self.assertEqual(self.tree(), ["training/calib_cam_to_cam/000002.txt", "training/image_2/000002_10.png"])

    def test_demo(self):
        self.server.files[DEMO] = demo_archive()
        self.server.sizes = False  # as the real server, which makes its archives while sending
        text = self.fetch("fetch_demo")
        self.assertEqual(self.tree(), ["depth/000000.png", "flow/000000.flo", "image_0/000000.png", "kitti03.yaml",
                                       "object_pose.txt", "pose_gt.txt", "semantic/000000.txt", "times.txt"])
        self.assertIn("does not say the size", text)
        self.assertIn(f"vdo:{self.out}", text)

    def test_demo_without_a_channel_is_refused(self):
        self.server.files[DEMO] = demo_archive(without="flow")
        self.assertIn("has no flow", self.fetch("fetch_demo", code=5))
        self.assertEqual(self.tree(), [])

    # ---- resuming

    def test_second_run_downloads_nothing(self):
        self.server.files = vkitti1_archives()
        self.fetch("fetch_vkitti1", "--rgb")
        self.server.requests.clear()
        self.assertIn("already in", self.fetch("fetch_vkitti1", "--rgb", accept=False))
        self.assertEqual(self.server.requests, [])
        shutil.rmtree(self.out / "vkitti_1.3.1_rgb")  # gone: is fetched again
        self.fetch("fetch_vkitti1", "--rgb")
        self.assertEqual(len(self.tree()), 8)

    def test_cut_connection_is_resumed_in_the_same_run(self):
        self.server.files = vkitti1_archives()
        self.server.cut_after = [100000]
        self.fetch("fetch_vkitti1", "--rgb")
        self.assertEqual([r.range for r in self.server.gets()], [None, "bytes=100000-"])
        self.assertEqual(len(self.tree()), 8)

    def test_cut_connection_is_resumed_by_the_next_run(self):
        self.server.files = vkitti1_archives()
        self.server.cut_after = [100000]
        text = self.fetch("fetch_vkitti1", "--rgb", code=4, SEXTANT_FETCH_ATTEMPTS="1")
        self.assertIn("was cut", text)
        self.assertEqual((self.out / ".fetch/vkitti_1.3.1_rgb.tar.part").stat().st_size, 100000)
        self.assertEqual(self.tree(), [])
        self.fetch("fetch_vkitti1", "--rgb")
        self.assertEqual([r.range for r in self.server.gets()], [None, "bytes=100000-"])
        self.assertEqual(len(self.tree()), 8)

    def test_server_without_ranges(self):
        self.server.files = vkitti1_archives()
        self.server.ranges = False
        self.server.cut_after = [100000]
        self.assertIn("start again", self.fetch("fetch_vkitti1", "--rgb"))
        self.assertEqual([r.range for r in self.server.gets()], [None, "bytes=100000-", None])
        self.assertEqual(len(self.tree()), 8)

    def test_file_that_changed_on_the_server_is_not_resumed(self):
        self.server.files = vkitti1_archives()
        self.server.cut_after = [100000]
        self.fetch("fetch_vkitti1", "--rgb", code=4, SEXTANT_FETCH_ATTEMPTS="1")
        self.server.files["vkitti_1.3.1_rgb.tar"] = tar({"vkitti_1.3.1_rgb/0001/clone/00000.png": noise(300000)})
        self.assertIn("has changed", self.fetch("fetch_vkitti1", "--rgb"))
        self.assertEqual([r.range for r in self.server.gets()], [None, None])
        self.assertEqual((self.out / "vkitti_1.3.1_rgb/0001/clone/00000.png").read_bytes(), noise(300000))

    def test_interrupt_leaves_what_the_next_run_needs(self):
        self.server.files = vkitti1_archives()
        self.server.stall_after = 100000
        process = subprocess.Popen(self.command("fetch_vkitti1", "--rgb"), stdin=subprocess.DEVNULL, text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=self.environment())
        part = self.out / ".fetch/vkitti_1.3.1_rgb.tar.part"
        deadline = time.monotonic() + HANGS_S
        while not (part.exists() and part.stat().st_size > 0) and time.monotonic() < deadline:
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        output = "".join(process.communicate(timeout=HANGS_S))
        self.assertEqual(process.returncode, 130, output)
        self.assertIn("interrupted", output)
        kept = part.stat().st_size
        self.assertGreater(kept, 0)
        self.assertEqual(self.tree(), [])
        self.server.stall_after = None
        self.fetch("fetch_vkitti1", "--rgb")
        self.assertEqual(self.server.gets()[-1].range, f"bytes={kept}-")
        self.assertEqual(len(self.tree()), 8)
        self.assertEqual(self.leftovers(), ["lock", "placed"])

    def test_interrupt_while_unpacking_leaves_no_half_folder(self):
        self.server.files = vkitti1_archives()
        tools = self.folder / "tools"  # a tar that unpacks and then hangs
        tools.mkdir()
        (tools / "tar").write_text(f'#!/bin/sh\n{shutil.which("tar")} "$@" || exit\n'
                                   'case " $* " in *" -xf "*) exec sleep 6000 ;; esac\n')
        (tools / "tar").chmod(0o755)
        process = subprocess.Popen(self.command("fetch_vkitti1", "--rgb"), stdin=subprocess.DEVNULL, text=True,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   env=self.environment(PATH=f"{tools}:{os.environ['PATH']}"))
        deadline = time.monotonic() + HANGS_S
        while len(list(self.out.glob(".fetch/unpack.*/files/**/*.png"))) < 8 and time.monotonic() < deadline:
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        output = "".join(process.communicate(timeout=HANGS_S))
        self.assertEqual(process.returncode, 130, output)
        self.assertEqual(self.tree(), [])
        self.assertEqual(list(self.out.glob(".fetch/unpack.*")), [])
        self.server.requests.clear()
        self.fetch("fetch_vkitti1", "--rgb")
        self.assertEqual(self.server.requests, [])  # the archive was whole
        self.assertEqual(len(self.tree()), 8)

    # ---- what is refused

    def test_checksums(self):
        self.server.files = vkitti1_archives()
        content = self.server.files["vkitti_1.3.1_rgb.tar"]
        sums = {"md5": hashlib.md5(content).hexdigest(), "sha256": hashlib.sha256(content).hexdigest()}
        for algorithm, right in sums.items():
            wrong = "0" * len(right)
            self.pins.write_text(f"{algorithm} {wrong} vkitti_1.3.1_rgb.tar\n")
            text = self.fetch("fetch_vkitti1", "--rgb", code=5)
            self.assertIn(f"{algorithm} sum {right}", text)
            self.assertEqual(self.tree(), [])
            self.assertTrue((self.out / ".fetch/vkitti_1.3.1_rgb.tar.rejected").is_file())
        self.pins.write_text("".join(f"{a} {s} vkitti_1.3.1_rgb.tar\n" for a, s in sums.items()))
        self.fetch("fetch_vkitti1", "--rgb")
        self.assertEqual(len(self.tree()), 8)

    def test_malformed_checksums(self):
        self.server.files = vkitti1_archives()
        self.pins.write_text("# sums\nmd5 12 vkitti_1.3.1_rgb.tar\n")
        self.assertIn("pins.txt:2: expected", self.fetch("fetch_vkitti1", "--rgb", code=2))

    def test_own_checksums_are_well_formed(self):
        archives = {row.split("|")[2] for script in SCRIPTS.glob("fetch_[a-z]*") if not script.suffix
                    for row in re.findall(r'^  "(.+\|.+)"$', script.read_text(), re.M)}
        for line in (SCRIPTS / "fetch_checksums.txt").read_text().splitlines():
            if line and not line.startswith("#"):
                self.assertRegex(line, r"^(md5 [0-9a-f]{32}|sha256 [0-9a-f]{64}) [^ ]+$")
                self.assertIn(line.split()[2], archives)

    def test_truncated_archives(self):
        whole = {**vkitti1_archives(), **kitti_archives()}
        for script, part, name in (("fetch_vkitti1", "--rgb", "vkitti_1.3.1_rgb.tar"),
                                   ("fetch_vkitti1", "--objects", "vkitti_1.3.1_motgt.tar.gz"),
                                   ("fetch_kitti_tracking", "--oxts", "data_tracking_oxts.zip")):
            with self.subTest(name):
                self.server.files[name] = whole[name][: len(whole[name]) * 2 // 3]
                self.assertIn("truncated or no archive", self.fetch(script, part, code=5))
                self.assertEqual(self.tree(), [])
                self.server.files[name] = whole[name]
                self.fetch(script, part)
                self.assertNotEqual(self.tree(), [])
                shutil.rmtree(self.out)

    def test_damaged_zip(self):
        content = bytearray(zip_of({"training/oxts/0003.txt": noise(1000)}))
        content[500] ^= 1
        self.server.files["data_tracking_oxts.zip"] = bytes(content)
        self.assertIn("truncated or no archive", self.fetch("fetch_kitti_tracking", "--oxts", code=5))

    def test_page_instead_of_an_archive(self):
        for script, part, name in (("fetch_vkitti1", "--rgb", "vkitti_1.3.1_rgb.tar"),
                                   ("fetch_kitti_tracking", "--oxts", "data_tracking_oxts.zip")):
            self.server.files[name] = b"<html>please log in</html>\n" * 100
            self.assertIn("no archive at all", self.fetch(script, part, code=5))

    def test_unsafe_members(self):
        good = {"vkitti_1.3.1_rgb/0001/clone/00000.png": b"x"}
        for name, archive in {
            "../evil": tar({**good, "../evil": b"e"}),
            "vkitti_1.3.1_rgb/../../evil": tar({**good, "vkitti_1.3.1_rgb/../../evil": b"e"}),
            "/tmp/evil": tar({**good, "/tmp/evil": b"e"}),
            "vkitti_1.3.1_rgb/link": tar(good, links=[("vkitti_1.3.1_rgb/link", "/tmp")]),
        }.items():
            with self.subTest(name):
                self.server.files["vkitti_1.3.1_rgb.tar"] = archive
                self.assertIn(f"unsafe member: {name}", self.fetch("fetch_vkitti1", "--rgb", code=5))
                self.assertEqual(self.tree(), [])
        self.server.files["data_tracking_oxts.zip"] = zip_of({"training/oxts/0003.txt": "x", "../evil": "e"})
        self.assertIn("unsafe member: ../evil", self.fetch("fetch_kitti_tracking", "--oxts", code=5))
        self.assertEqual(list(self.folder.rglob("evil")), [])

    def test_links_of_any_system_in_a_zip(self):
        foreign = self.folder / "foreign"
        foreign.mkdir()
        (foreign / "mine.txt").write_text("mine")
        archives = self.folder / "archives"
        archives.mkdir()
        refused = 0
        for host in range(20):  # MS-DOS, OpenVMS, Unix, .. Darwin
            for external, asi in ((True, False), (False, True), (True, True)) if host in (0, 2, 3) else ((True, True),):
                with self.subTest(host=host, external=external, asi=asi):
                    (archives / "data_tracking_oxts.zip").write_bytes(
                        zip_with_link("training/oxts/0005.txt", str(foreign), host, external, asi))
                    done = subprocess.run(self.command("fetch_kitti_tracking", "--oxts", "--archives", str(archives)), text=True,
                                          timeout=HANGS_S, stdin=subprocess.DEVNULL, capture_output=True, env=self.environment())
                    self.assertIn(done.returncode, (0, 5), done.stdout + done.stderr)
                    refused += done.returncode == 5
                    if done.returncode == 5:
                        self.assertIn("unsafe member: training/oxts/0005.txt", done.stderr)
                        self.assertEqual(self.tree(), [])
                    self.assertEqual([p for p in self.out.rglob("*") if p.is_symlink()], [])
                    self.assertEqual((foreign / "mine.txt").read_text(), "mine")
                    shutil.rmtree(self.out)
        self.assertGreater(refused, 0)

    def test_nothing_is_placed_through_a_link(self):
        foreign = self.folder / "foreign"
        for script, part, archives, link in (("fetch_kitti_tracking", "--masks", kitti_archives(), "training"),
                                             ("fetch_kitti_tracking", "--oxts", kitti_archives(), "training"),
                                             ("fetch_vkitti1", "--rgb", vkitti1_archives(), "vkitti_1.3.1_rgb"),
                                             ("fetch_kitti_tracking", "--oxts", kitti_archives(), ".fetch")):
            with self.subTest(part=part, link=link):
                self.server.files = archives
                foreign.mkdir()
                self.out.mkdir()
                (self.out / link).symlink_to(foreign)
                done = subprocess.run(self.command(script, part), text=True, timeout=HANGS_S, stdin=subprocess.DEVNULL,
                                      capture_output=True, env=self.environment())
                self.assertNotEqual(done.returncode, 0, done.stdout)
                self.assertEqual(list(foreign.iterdir()), [])
                shutil.rmtree(self.out)
                foreign.rmdir()

    def test_other_layout(self):
        self.server.files["vkitti_1.3.1_rgb.tar"] = tar({"0001/clone/00000.png": b"x"})
        self.assertIn("holds nothing of Virtual KITTI", self.fetch("fetch_vkitti1", "--rgb", code=5))

    def test_missing_file(self):
        text = self.fetch("fetch_vkitti1", "--rgb", code=4)
        self.assertIn("HTTP status 404 (no such file)", text)
        self.assertIn("/sub/vkitti_1.3.1_rgb.tar", text)
        self.assertEqual(len(self.server.requests), 1)  # trying again cannot help

    def test_failing_server_is_tried_again(self):
        self.server.files = vkitti1_archives()
        self.server.status["vkitti_1.3.1_rgb.tar"] = 503
        text = self.fetch("fetch_vkitti1", "--rgb", code=4)
        self.assertIn("HTTP status 503", text)
        self.assertIn("gave up after 3 attempts", text)

    def test_server_without_head(self):
        self.server.files = vkitti1_archives()
        self.server.head = False
        self.server.cut_after = [100000]
        self.fetch("fetch_vkitti1", "--rgb")
        self.assertEqual([r.range for r in self.server.gets()], [None, "bytes=100000-"])
        self.assertEqual(len(self.tree()), 8)

    def test_one_run_at_a_time(self):
        self.server.files = vkitti1_archives()
        (self.out / ".fetch").mkdir(parents=True)
        with open(self.out / ".fetch/lock", "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            self.assertIn("another", self.fetch("fetch_vkitti1", "--objects", code=2))
        self.fetch("fetch_vkitti1", "--objects")

    def test_no_network(self):
        self.assertIn("is there a network", self.fetch("fetch_vkitti1", "--rgb", code=4, mirror="http://127.0.0.1:9"))

    def test_errors_of_curl_are_explained(self):
        for code, status, words, again in ((6, "", "is not known: is there a network", True), (28, "", "in time", True),
                                           (23, "", "is the disk full", False), (60, "", "ca-certificates", False),
                                           (22, "403", "no permission", False), (22, "500", "status 500", True)):
            done = subprocess.run(["bash", "-c", 'source "$0"; explain "$1" "$2" ADDRESS && again=True; '
                                   'echo "$why ${again:-False}"', SCRIPTS / "fetch_common.sh", str(code), status],
                                  text=True, capture_output=True)
            self.assertIn(words, done.stdout)
            self.assertTrue(done.stdout.endswith(f" {again}\n"), done.stdout)

    def test_no_space(self):
        self.server.files = vkitti1_archives()
        self.server.claimed_size["vkitti_1.3.1_rgb.tar"] = 10**17
        text = self.fetch("fetch_vkitti1", "--rgb", code=6)
        self.assertRegex(text, r"the download needs 100PB, and .* has .*B free")
        self.assertEqual(self.server.gets(), [])

    def test_licence_is_shown_and_asked_for(self):
        self.server.files = vkitti1_archives()
        text = self.fetch("fetch_vkitti1", "--objects", code=3, accept=False)
        for words in ("CC BY-NC-SA 3.0", "https://", "Non-commercial", "CVPR 2016", "--accept-license"):
            self.assertIn(words, text)
        self.assertEqual(self.server.requests, [])
        self.assertFalse(self.out.exists())

    def test_licence_is_accepted_by_an_answer(self):
        self.server.files = vkitti1_archives()
        for answer, code, count in (("no", 3, 0), ("yes", 0, 4)):
            terminal, child_side = pty.openpty()
            process = subprocess.Popen(self.command("fetch_vkitti1", "--objects", accept=False), stdin=child_side,
                                       text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                       env=self.environment())
            os.write(terminal, f"{answer}\n".encode())
            output = process.communicate(timeout=HANGS_S)[0]
            os.close(terminal)
            os.close(child_side)
            self.assertEqual(process.returncode, code, output)
            self.assertEqual(len(self.tree()) if self.out.exists() else 0, count)

    def test_usage_errors(self):
        for arguments, words in ((["--thermal"], "unknown argument '--thermal'"), (["rgb"], "unknown argument 'rgb'"),
                                 (["--sequences", "0007"], "'0007' is none of"), (["--out"], "--out needs a value"),
                                 (["--mirror", "ftp://x"], "expected an http:// or https:// address"),
                                 (["--sequences", "../0001"], "is none of"),
                                 (["--checksums", "/nowhere"], "no such file")):
            with self.subTest(arguments):
                self.assertIn(words, self.fetch("fetch_vkitti1", *arguments, code=2))
        self.assertIn("single sequence", self.fetch("fetch_demo", "--sequences", "0003", code=2))
        self.assertEqual(self.server.requests, [])

    def test_missing_tool_is_named(self):
        tools = self.folder / "tools"
        tools.mkdir()
        for tool in ("awk", "basename", "bash", "dirname", "flock", "gzip", "sed", "sha256sum", "tar"):
            (tools / tool).symlink_to(shutil.which(tool))
        text = self.fetch("fetch_vkitti1", code=2, PATH=str(tools))
        self.assertIn("missing: curl (Debian package curl) unzip (Debian package unzip)", text)

    def test_archives_that_were_downloaded_before(self):
        archives = self.folder / "archives"
        archives.mkdir()
        (archives / "data_tracking_oxts.zip").write_bytes(kitti_archives()["data_tracking_oxts.zip"])
        self.fetch("fetch_kitti_tracking", "--oxts", "--archives", str(archives))
        self.assertEqual(self.tree(), ["training/oxts/0003.txt", "training/oxts/0005.txt"])
        self.assertEqual(self.server.requests, [])
        self.assertTrue((archives / "data_tracking_oxts.zip").is_file())

    def test_kept_archive_is_unpacked_again(self):
        self.server.files = kitti_archives()
        self.fetch("fetch_kitti_tracking", "--left", "--sequences", "0003", "--keep-archives")
        self.server.requests.clear()
        self.fetch("fetch_kitti_tracking", "--left", "--sequences", "0005")
        self.assertEqual(self.server.requests, [])
        self.assertEqual(len(self.tree()), 4)

    def test_list_needs_no_network(self):
        for script in ("fetch_vkitti1", "fetch_vkitti2", "fetch_kitti_tracking", "fetch_sceneflow2015", "fetch_demo"):
            done = subprocess.run([SCRIPTS / script, "--list"], text=True, capture_output=True, env=self.environment())
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertRegex(done.stdout, r"https://(download\.europe\.naverlabs\.com|s3\.eu-central-1|codeload)")


if __name__ == "__main__":
    unittest.main()
