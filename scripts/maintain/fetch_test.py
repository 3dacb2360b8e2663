#!/usr/bin/env python3
"""Tests of scripts/fetch: each data set against a server on this machine, with small archives made here.

usage: scripts/maintain/fetch_test.py [TEST...]
"""

import contextlib
import fcntl
import hashlib
import os
import pathlib
import pty
import resource
import runpy
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import types
import unittest

HANGS_S = 1200  # ends a script that hangs; nothing waits for a clock
SCRIPTS = pathlib.Path(__file__).resolve().parent.parent
sys.dont_write_bytecode = True
sys.path.insert(0, str(SCRIPTS))
from fetch_data_sets import DATA_SETS  # noqa: E402
from fetch_server import ARCHIVES, DEMO, DEMO_FILES, NOISE, OXTS, PUBLISHED, RGB, Server, names, packed, zip_link  # noqa: E402

PROGRAM = types.SimpleNamespace(**runpy.run_path(str(SCRIPTS / "fetch")))


class FetchTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="sextant_fetch_"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.out = self.folder / "data set"  # a space, as paths may have one
        self.archives, self.foreign, self.pins = (self.folder / name for name in ("archives", "foreign", "pins.txt"))
        self.archives.mkdir()
        self.pins.write_text("# none\n\n")
        self.server = Server()
        threading.Thread(target=self.server.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()
        for stop in (self.server.server_close, self.server.shutdown, self.server.released.set):
            self.addCleanup(stop)
        self.mirror = f"http://127.0.0.1:{self.server.server_address[1]}/sub"

    def command(self, data_set, *arguments, accept=True):
        return [str(SCRIPTS / "fetch"), data_set, "--out", str(self.out), "--mirror", self.mirror, "--checksums", str(self.pins),
                *(["--accept-license"] if accept else []), *arguments]

    def environment(self, **more):
        kept = {k: v for k, v in os.environ.items() if not k.startswith("SEXTANT_") and not k.lower().endswith("_proxy")}
        return {**kept, "SEXTANT_FETCH_WAIT": "0", "SEXTANT_FETCH_ATTEMPTS": "3", **more}

    def finish(self, command, code=0, setup=None, **environment):
        """Runs a command to its end, and returns what it printed. Checks its exit code, and that a failure places nothing."""
        before = self.tree()
        done = subprocess.run(command, text=True, timeout=HANGS_S, stdin=subprocess.DEVNULL, capture_output=True,
                              env=self.environment(**environment), preexec_fn=setup)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        self.assertTrue(code == 0 or self.tree() == before)
        return done.stdout + done.stderr

    def fetch(self, *arguments, code=0, accept=True, **environment):
        return self.finish(self.command(*arguments, accept=accept), code, **environment)

    def interrupt(self, command, is_time):
        """Starts a command, and interrupts it when is_time() holds."""
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, text=True, stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, env=self.environment())
        deadline = time.monotonic() + HANGS_S
        while not is_time() and time.monotonic() < deadline:
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        output = process.communicate(timeout=HANGS_S)[0]
        self.assertEqual(process.returncode, 130, output)
        self.assertIn("interrupted", output)
        self.assertEqual(self.tree(), [])

    def tree(self):
        """Files in the output folder, without the state of scripts/fetch."""
        found = (p.relative_to(self.out) for p in self.out.rglob("*") if p.is_file() or p.is_symlink())
        return sorted(str(p) for p in found if ".fetch" not in p.parts)

    def leftovers(self):
        return [p.name for p in (self.out / ".fetch").iterdir() if p.suffix != ".done"]

    def gets(self):  # the ranges of the downloads
        return [wanted for _, wanted in self.server.requests]

    @contextlib.contextmanager
    def no_request(self):
        """Checks that a block asks the server for nothing."""
        self.server.requests.clear()
        yield
        self.assertEqual(self.server.requests, [])

    def assert_rgb_is_complete(self, *ranges):
        """Checks the files of vkitti1 --rgb, and the ranges of the downloads."""
        self.assertEqual((self.tree(), self.gets()), (PUBLISHED[RGB], list(ranges)))

    # ---- what is unpacked

    def check_layout(self, options, expected, words=()):
        self.server.requests.clear()
        text = self.fetch(*options.split())
        self.assertEqual(self.tree(), expected)
        for name in self.tree():
            content = (self.out / name).read_bytes().removesuffix(NOISE).decode()
            self.assertTrue(content.endswith(name) or name.endswith(content), f"{name} holds {content}")
        self.assertEqual([word for word in words if word not in text], [], text)
        self.assertEqual(self.leftovers(), ["lock"])
        self.assertTrue(all(p.stat().st_mode & 0o500 == 0o500 for p in self.out.rglob("*") if p.is_dir()))
        shutil.rmtree(self.out)

    def test_layouts(self):
        for options, words in (
                ("vkitti1 --all", ["CC BY-NC-SA 3.0", f"vkitti1:{self.out}#0018/clone", hashlib.sha256(ARCHIVES[RGB]).hexdigest()]),
                ("vkitti1 --text-only", []), ("vkitti1", ["no part named: the text parts"]),
                ("vkitti2 --all", [f"vkitti2:{self.out}#Scene18/clone"]), ("sceneflow2015 --all", []),
                # The size is that of two files of training/, without that of testing/.
                ("kitti_tracking --all", ["oxts: unpack 44B", f"kitti:{self.out}#0003"])):
            with self.subTest(options):
                parts = [part for part in DATA_SETS[options.split()[0]].parts if part.kind == "text" or options.endswith("--all")]
                members = (name.removeprefix("./") for part in parts for name in PUBLISHED[part.archive])
                self.check_layout(options, sorted(name.replace("instances", "training/instances", 1) for name in members
                                                  if not name.startswith("testing/")), words)
                self.assertEqual({name for name, _ in self.server.requests}, {part.archive for part in parts})

    def test_layouts_of_selected_members(self):
        scene = "Scene01/clone/frames/rgb/Camera_0/a"
        self.server.files["vkitti_2.0.3_rgb.tar"] = packed("vkitti_2.0.3_rgb.tar", ["vkitti_2.0.3_rgb/" + scene])
        self.check_layout("vkitti2 --rgb", [scene])
        self.check_layout("kitti_tracking --text-only --left --sequences 0003", names(
            "training/(calib|oxts|label_02|instances_txt)/0003.txt", "training/image_02/0003/00000(0|1).png"))
        self.server.files["instances_txt.zip"] = packed("instances_txt.zip", names("(0003|0005).txt"))
        self.check_layout("kitti_tracking --masks", names("training/instances_txt/(0003|0005).txt"))

    def test_sequences_are_added(self):
        self.fetch("vkitti1", "--masks", "--objects", "--sequences", "0018/clone")
        first = names("vkitti_1.3.1_motgt/0018_clone.txt", "vkitti_1.3.1_scenegt/0018/clone/0000(0|1).png",
                      "vkitti_1.3.1_scenegt/0018_clone_scenegt_rgb_encoding.txt")
        self.assertEqual(self.tree(), first)
        self.fetch("vkitti1", "--masks", "--objects", "--sequences", "0001")
        second = names("vkitti_1.3.1_motgt/0001_(clone|15-deg-left).txt", "vkitti_1.3.1_scenegt/0001/(clone|15-deg-left)/0000(0|1).png",
                       "vkitti_1.3.1_scenegt/0001_(clone|15-deg-left)_scenegt_rgb_encoding.txt")
        self.assertEqual(self.tree(), sorted(first + second))
        with self.no_request():
            self.fetch("vkitti1", "--masks", "--objects", "--sequences", "0018/clone,0001/clone")
        self.assertIn("holds nothing of 0020", self.fetch("vkitti1", "--masks", "--sequences", "0020", code=5))

    def test_demo(self):
        self.server.sizes = False  # as the real server, which makes its archives while sending
        text = self.fetch("demo")
        self.assertEqual(self.tree(), names(*DEMO_FILES))
        self.assertIn(f"vdo:{self.out}", text)

    def test_second_run_downloads_nothing(self):
        self.fetch("vkitti1", "--rgb")
        with self.no_request():
            self.assertIn("already in", self.fetch("vkitti1", "--rgb", accept=False))
        shutil.rmtree(self.out / "vkitti_1.3.1_rgb")  # gone: is fetched again
        self.fetch("vkitti1", "--rgb")
        self.assert_rgb_is_complete(None)

    def test_cut_connection_is_resumed_in_the_same_run(self):
        for ranges, further in ((True, []), (False, [None])):
            with self.subTest(ranges=ranges):
                self.server.requests.clear()
                self.server.ranges = ranges
                self.server.cut_after = [100000]
                self.assertIn("go on after", self.fetch("vkitti1", "--rgb"))
                self.assert_rgb_is_complete(None, "bytes=100000-", *further)
                shutil.rmtree(self.out)

    def test_cut_connection_is_resumed_by_the_next_run_unless_the_file_has_changed(self):
        for members, further in ((PUBLISHED[RGB], []), (PUBLISHED[RGB][3:], [None])):
            self.server.requests.clear()
            self.server.cut_after = [100000]
            self.assertIn("bytes remaining", self.fetch("vkitti1", "--rgb", code=4, SEXTANT_FETCH_ATTEMPTS="1"))
            self.assertEqual((self.out / f".fetch/{RGB}.part").stat().st_size, 100000)
            self.server.files[RGB] = packed(RGB, members)
            self.fetch("vkitti1", "--rgb")
            self.assertEqual((self.tree(), self.gets()), (members, [None, "bytes=100000-", *further]))
            shutil.rmtree(self.out)

    def test_interrupt_leaves_what_the_next_run_needs(self):
        self.server.stall_after = 100000
        part = self.out / f".fetch/{RGB}.part"
        self.interrupt(self.command("vkitti1", "--rgb"), lambda: part.exists() and part.stat().st_size > 0)
        kept = part.stat().st_size
        self.assertGreater(kept, 0)
        self.server.stall_after = None
        self.fetch("vkitti1", "--rgb")
        self.assert_rgb_is_complete(None, f"bytes={kept}-")
        self.assertEqual(self.leftovers(), ["lock"])

    def test_interrupt_while_unpacking_leaves_no_half_folder(self):
        hangs = ("import runpy, shutil, sys, time; copy, count = shutil.copyfileobj, []\n"
                 "def slow(*words):\n    copy(*words); words[1].flush(); count.append(1)\n"
                 "    if len(count) == 8: time.sleep(6000)\n"
                 "shutil.copyfileobj, sys.path[0:1] = slow, sys.argv[1:2]\n"
                 "sys.argv = [sys.argv[1] + '/fetch', *sys.argv[2:]]; runpy.run_path(sys.argv[0], run_name='__main__')")
        self.interrupt([sys.executable, "-c", hangs, str(SCRIPTS), *self.command("vkitti1", "--rgb")[1:]],
                       lambda: len(list(self.out.glob(".fetch/unpack.*/files/**/*.png"))) == 8)
        self.assertEqual(list(self.out.glob(".fetch/unpack.*")), [])
        with self.no_request():  # the archive was whole
            self.fetch("vkitti1", "--rgb")
        self.assert_rgb_is_complete()

    def test_kept_archive_is_unpacked_again(self):
        self.fetch("kitti_tracking", "--left", "--sequences", "0003", "--keep-archives")
        with self.no_request():
            self.fetch("kitti_tracking", "--left", "--sequences", "0005")
        self.assertEqual(self.tree(), names("training/image_02/(0003|0005)/00000(0|1).png"))

    def test_archives_that_were_downloaded_before(self):
        (self.archives / OXTS).write_bytes(ARCHIVES[OXTS])
        with self.no_request():
            self.fetch("kitti_tracking", "--oxts", "--archives", str(self.archives))
        self.assertEqual(self.tree(), names("training/oxts/(0003|0005).txt"))
        self.assertTrue((self.archives / OXTS).is_file())

    # ---- what is refused

    def test_checksums(self):
        sums = {name: hashlib.new(name, ARCHIVES[RGB]).hexdigest() for name in ("md5", "sha256")}
        for algorithm, right in sums.items():
            self.pins.write_text(f"{algorithm} {'0' * len(right)} {RGB}\n")
            self.assertIn(f"{algorithm} sum {right}", self.fetch("vkitti1", "--rgb", code=5))
            self.assertTrue((self.out / f".fetch/{RGB}.rejected").is_file())
        self.pins.write_text("".join(f"{a} {s} {RGB}\n" for a, s in sums.items()))
        self.fetch("vkitti1", "--rgb")
        self.assertEqual(self.tree(), PUBLISHED[RGB])
        shutil.rmtree(self.out)
        self.pins.write_text(f"# sums\nmd5 12 {RGB}\n")
        self.assertIn("pins.txt:2: expected", self.fetch("vkitti1", "--rgb", code=2))

    def test_own_checksums_are_well_formed(self):
        archives = {part.archive for data_set in DATA_SETS.values() for part in data_set.parts}
        for line in (SCRIPTS / "fetch_checksums.txt").read_text().splitlines():
            if line and not line.startswith("#"):
                self.assertRegex(line, r"^(md5 [0-9a-f]{32}|sha256 [0-9a-f]{64}) [^ ]+$")
                self.assertIn(line.split()[2], archives)

    def test_refused_archives(self):
        """The published archive is accepted after a wrong one was refused."""
        damaged = bytearray(ARCHIVES[OXTS])
        damaged[60] ^= 1  # in the content of the first member
        motgt, page = "vkitti_1.3.1_motgt.tar.gz", b"<html>please log in</html>\n" * 100
        evil = ("../evil", "vkitti_1.3.1_rgb/../../evil", "/tmp/evil")
        without_flow = [name for name in PUBLISHED[DEMO] if "/flow/" not in name]
        for what, archive, content, words in (
                *((f"truncated {name}", name, ARCHIVES[name][: len(ARCHIVES[name]) * 2 // 3], "truncated or no archive")
                  for name in (RGB, motgt, OXTS)),
                ("damaged", OXTS, bytes(damaged), "truncated or no archive"),
                *((f"page instead of {name}", name, page, "no archive at all") for name in (RGB, OXTS)),
                *((name, RGB, packed(RGB, [PUBLISHED[RGB][0], name]), f"unsafe member: {name}") for name in evil),
                ("link in a tar", RGB, packed(RGB, PUBLISHED[RGB][:1], ("vkitti_1.3.1_rgb/link", "/tmp")),
                 "unsafe member: vkitti_1.3.1_rgb/link"),
                ("../evil in a zip", OXTS, packed(OXTS, ["training/oxts/0003.txt", "../evil"]), "unsafe member: ../evil"),
                ("other layout", RGB, packed(RGB, ["0001/clone/00000.png"]), "holds nothing of Virtual KITTI"),
                ("demo without flow", DEMO, packed(DEMO, without_flow), "has no flow")):
            with self.subTest(what):
                options = {RGB: ("vkitti1", "--rgb"), motgt: ("vkitti1", "--objects"), OXTS: ("kitti_tracking", "--oxts"),
                           DEMO: ("demo",)}[archive]
                self.server.files[archive] = content
                self.assertIn(words, self.fetch(*options, code=5))
                self.assertEqual(list(self.folder.rglob("evil")), [])
                self.server.files[archive] = ARCHIVES[archive]
                if what in ("other layout", "demo without flow"):  # an intact archive of another layout is kept
                    shutil.rmtree(self.out / ".fetch")
                self.fetch(*options)
                self.assertNotEqual(self.tree(), [])
                shutil.rmtree(self.out)

    def test_links_of_any_system_in_a_zip(self):
        self.foreign.mkdir()
        (self.foreign / "mine.txt").write_text("mine")
        for host in range(20):  # MS-DOS, OpenVMS, Unix, .. Darwin
            for external, asi in ((True, False), (False, True), (True, True)) if host in (0, 2, 3) else ((True, True),):
                with self.subTest(host=host, external=external, asi=asi):
                    link = zip_link("training/oxts/0005.txt", str(self.foreign), host, external, asi)
                    (self.archives / OXTS).write_bytes(packed(OXTS, ["training/oxts/0003.txt"], link))
                    text = self.fetch("kitti_tracking", "--oxts", "--archives", str(self.archives), code=5)
                    self.assertIn("unsafe member: training/oxts/0005.txt", text)
                    self.assertEqual([p for p in self.out.rglob("*") if p.is_symlink()], [])
                    self.assertEqual((self.foreign / "mine.txt").read_text(), "mine")
                    shutil.rmtree(self.out)

    def test_nothing_is_placed_through_a_link(self):
        for options, link in (("kitti_tracking --masks", "training"), ("kitti_tracking --oxts", "training"),
                              ("vkitti1 --rgb", "vkitti_1.3.1_rgb"), ("kitti_tracking --oxts", ".fetch")):
            with self.subTest(options=options, link=link):
                self.foreign.mkdir()
                self.out.mkdir()
                (self.out / link).symlink_to(self.foreign)
                self.assertIn("is a link: nothing is placed through it", self.fetch(*options.split(), code=2))
                self.assertEqual(list(self.foreign.iterdir()), [])
                shutil.rmtree(self.out)
                self.foreign.rmdir()

    def test_one_run_at_a_time(self):
        (self.out / ".fetch").mkdir(parents=True)
        with open(self.out / ".fetch/lock", "w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            self.assertIn("another", self.fetch("vkitti1", "--objects", code=2))
        self.fetch("vkitti1", "--objects")

    # ---- the server and the disk

    def test_only_failures_that_may_pass_are_tried_again(self):
        for status, asked, words in ((404, 1, ["HTTP status 404 (no such file)", f"/sub/{RGB}"]),
                                     (503, 3, ["HTTP status 503", "gave up after 3 attempts"])):
            self.server.requests.clear()
            self.server.status[RGB] = status
            text = self.fetch("vkitti1", "--rgb", code=4)
            self.assertEqual([word for word in words if word not in text], [], text)
            self.assertEqual(self.gets(), asked * [None])

    def test_no_network(self):
        self.assertIn("is there a network", self.fetch("vkitti1", "--rgb", "--mirror", "http://127.0.0.1:9", code=4))

    def test_encryption_is_never_left(self):
        for scheme, redirected in (("https", "=https"), ("http", "=http,https")):
            command = PROGRAM.curl(f"{scheme}://a.example/x", self.folder / "x", self.folder / "version")
            self.assertEqual(command[command.index("--proto-redir") + 1], redirected)

    def test_full_disk(self):
        self.assertIn("is the disk full", self.finish(
            self.command("vkitti1", "--rgb"), 6, lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (100000, 100000))))

    def test_no_space(self):
        self.server.claimed_size[RGB] = 10**17
        self.assertRegex(self.fetch("vkitti1", "--rgb", code=6), "the download needs more than is free")
        self.assertFalse((self.out / f".fetch/{RGB}.part").exists())

    # ---- the command line

    def test_licence_is_shown_and_asked_for(self):
        with self.no_request():
            text = self.fetch("vkitti1", "--objects", code=3, accept=False)
        for words in ("CC BY-NC-SA 3.0", "https://", "Non-commercial", "CVPR 2016", "--accept-license"):
            self.assertIn(words, text)
        self.assertFalse(self.out.exists())

    def test_licence_is_accepted_by_an_answer(self):
        for answer, code, count in (("no", 3, 0), ("yes", 0, 4)):
            terminal, child_side = pty.openpty()
            process = subprocess.Popen(self.command("vkitti1", "--objects", accept=False), stdin=child_side, text=True,
                                       stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=self.environment())
            os.write(terminal, f"{answer}\n".encode())
            output = process.communicate(timeout=HANGS_S)[0]
            os.close(terminal)
            os.close(child_side)
            self.assertEqual(process.returncode, code, output)
            self.assertEqual(len(self.tree()), count)

    def test_usage_errors(self):
        for options, words in (("vkitti1 --thermal", "unrecognized arguments: --thermal"),
                               ("vkitti1 rgb", "unrecognized arguments: rgb"),
                               ("vkitti1 --sequences 0007", "'0007' is none of"),
                               ("vkitti1 --sequences ../0001", "is none of"),
                               ("demo --sequences 0003", "unrecognized arguments: --sequences"),
                               ("vkitti1 --out", "argument --out: expected one argument"),
                               ("vkitti1 --mirror ftp://x", "expected an http:// or https:// address"),
                               ("vkitti1 --checksums /nowhere", "no such file")):
            with self.subTest(options), self.no_request():
                self.assertIn(words, self.fetch(*options.split(), code=2))

    def test_list_needs_no_network(self):
        for name in DATA_SETS:
            text = self.finish([SCRIPTS / "fetch", name, "--list"])
            self.assertIn(f"scripts/fetch {name}", text)
            self.assertRegex(text, r"https://(download\.europe\.naverlabs\.com|s3\.eu-central-1|codeload)")


if __name__ == "__main__":
    unittest.main()
