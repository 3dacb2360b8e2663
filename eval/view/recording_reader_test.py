#!/usr/bin/env python3
"""usage: recording_reader_test.py SEXTANT

Reads a recording of `sextant export --format mcap` by an independent reader, @mcap/core of the npm registry, and compares
the camera's poses with the trajectory files of the run to 1e-12. Exit code 77 (skipped) without node or the package:
`npm install --global @mcap/core` installs it.
"""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile

READER = """
const {McapIndexedReader} = require("@mcap/core");
const {open} = require("fs/promises");
(async () => {
  const file = await open(process.argv[2], "r");
  const size = BigInt((await file.stat()).size);
  const readable = {
    size: async () => size,
    read: async (offset, length) => {
      const buffer = new Uint8Array(Number(length));
      await file.read(buffer, 0, Number(length), Number(offset));
      return buffer;
    },
  };
  const reader = await McapIndexedReader.Initialize({readable});
  const found = [];
  for await (const message of reader.readMessages()) {
    const channel = reader.channelsById.get(message.channelId);
    const schema = reader.schemasById.get(channel.schemaId);
    JSON.parse(new TextDecoder().decode(schema.data));
    const content = JSON.parse(new TextDecoder().decode(message.data));
    found.push({topic: channel.topic, type: schema.name, ns: String(message.logTime), content});
  }
  console.log(JSON.stringify({statistics: Number(reader.statistics.messageCount), found}));
})();
"""


def modules():
    """The folder that holds @mcap/core, or None."""
    places = os.environ.get("NODE_PATH", "").split(":")
    if shutil.which("npm"):
        places.append(subprocess.run(["npm", "root", "--global"], capture_output=True, text=True, check=False).stdout.strip())
    return next((place for place in places if place and (pathlib.Path(place) / "@mcap" / "core").is_dir()), None)


def main():
    sextant = sys.argv[1]
    place = modules()
    if not shutil.which("node") or place is None:
        print("skipped: needs node and `npm install --global @mcap/core`")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        run, recording = f"{folder}/run", f"{folder}/run.mcap"
        noise = '{"depth": {"delta_d_px": 0.2}, "flow": {"epe_px": 0.5}}'
        subprocess.run([sextant, "run", "synthetic:s18", "--noise", noise, "--out", run, "--quiet"], check=True)
        subprocess.run([sextant, "export", run, "--format", "mcap", "--out", recording, "--quiet"], check=True)
        script = pathlib.Path(folder) / "read.js"
        script.write_text(READER, encoding="utf-8")
        read = json.loads(subprocess.run(["node", script, recording], check=True, capture_output=True, text=True,
                                         env=dict(os.environ, NODE_PATH=place)).stdout)
        assert read["statistics"] == len(read["found"]), "the statistics count all messages"
        largest = 0
        for side, file in (("estimate", "est_camera_tum.txt"), ("truth", "gt_camera_tum.txt")):
            poses = [m for m in read["found"] if m["topic"] == f"/camera/{side}"]
            lines = [line.split() for line in pathlib.Path(run, file).read_text(encoding="utf-8").splitlines()
                     if not line.startswith("#")]
            assert len(poses) == len(lines) > 0, (side, len(poses), len(lines))
            for message, line in zip(poses, lines):
                time, *expected = map(float, line)
                pose = message["content"]["pose"]
                got = [pose["position"][k] for k in "xyz"] + [pose["orientation"][k] for k in "xyzw"]
                sign = 1 if sum(a * b for a, b in zip(got[3:], expected[3:])) > 0 else -1
                got[3:] = [sign * value for value in got[3:]]
                largest = max(largest, abs(int(message["ns"]) / 1e9 - time), *(abs(a - b) for a, b in zip(got, expected)))
        types = {m["type"] for m in read["found"]}
        for name in ("PoseInFrame", "PosesInFrame", "FrameTransform", "SceneUpdate", "CompressedImage", "CameraCalibration"):
            assert f"foxglove.{name}" in types, name
        print(f"{len(read['found'])} messages, {len(types)} types, largest difference of a pose {largest:.1e}")
        assert largest <= 1e-12
    return 0


if __name__ == "__main__":
    sys.exit(main())
