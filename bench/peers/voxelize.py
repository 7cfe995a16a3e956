#!/usr/bin/env python3
"""Compares voxelizing a mesh with Quoin and with trimesh: voxel counts and seconds.

    bench/peers/voxelize.py QUOIN MESH [VOXELS]

QUOIN is the tool, MESH a file that both read, VOXELS how many along the longest side (64).
"""
import json
import os
import subprocess
import sys
import tempfile
import time


def quoin(tool, path, pitch, *options):
    """Runs the tool, which reads the mesh and writes a file. Returns voxels and seconds."""
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "out.binvox")
        started = time.perf_counter()
        subprocess.run([tool, "convert", path, out, "--voxel", repr(pitch), "-q", *options], check=True)
        seconds = time.perf_counter() - started
        printed = subprocess.run([tool, "info", "--json", out], check=True, capture_output=True)
    return json.loads(printed.stdout)["voxels"], seconds


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    try:
        import trimesh
    except ImportError:
        sys.exit("trimesh is not installed: pip install trimesh scipy")
    tool, path = sys.argv[1:3]
    mesh = trimesh.load(path, force="mesh", process=False)
    pitch = float(mesh.extents.max()) / int(sys.argv[3] if len(sys.argv) == 4 else 64)

    def show(name, voxels, seconds):
        print(f"{name:34} {voxels:12,} voxels {seconds:8.2f} s")

    started = time.perf_counter()
    surface = mesh.voxelized(pitch)
    show("trimesh, surface by subdivision", surface.filled_count, time.perf_counter() - started)
    filled = surface.copy().fill()
    show("trimesh, filled", filled.filled_count, time.perf_counter() - started)
    show("quoin, thin surface", *quoin(tool, path, pitch, "--surface"))
    show("quoin, thick surface", *quoin(tool, path, pitch, "--surface", "--separating", "26"))
    show("quoin, solid", *quoin(tool, path, pitch, "--solid"))
    print(f"the mesh's volume, where it is closed {abs(mesh.volume) / pitch ** 3:12,.0f} voxels")


if __name__ == "__main__":
    main()
