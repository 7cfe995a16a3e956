"""Packs the package, the library and its dependencies into a wheel. Usage: make_wheel.py LIBRARY VERSION FOLDER

The wheel is for Linux on x86-64 and any Python from 3.8 on: it contains no extension modules.
"""

import base64
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile

SYSTEM = re.compile(r"^(ld-linux.*|lib(c|m|dl|rt|pthread|gcc_s|stdc\+\+|resolv)\.so.*)$")


def needed(library):
    """Yields the names and paths of the libraries that a library needs, except those of every Linux system."""
    for line in subprocess.run(["ldd", library], check=True, capture_output=True, text=True).stdout.splitlines():
        found = re.match(r"\s*(\S+) => (/\S+)", line)
        if found and not SYSTEM.match(found.group(1)):
            yield found.group(1), found.group(2)


def copyright_of(path):
    """Returns the Debian package of a library and the path of its copyright file."""
    real = os.path.realpath(path)
    for name in (real, real.removeprefix("/usr")):  # packages may name either
        owner = subprocess.run(["dpkg", "-S", name], capture_output=True, text=True)
        if owner.returncode == 0:
            package = owner.stdout.split(":")[0]
            return package, f"/usr/share/doc/{package}/copyright"
    raise SystemExit(f"make_wheel: no package owns {path}, so its licence is unknown")


def fill(folder, library, version):
    here = os.path.dirname(os.path.abspath(__file__))
    info = os.path.join(folder, f"quoin-{version}.dist-info")
    licences = os.path.join(info, "licenses")
    package = os.path.join(folder, "quoin")
    os.makedirs(licences)
    os.makedirs(os.path.join(package, "libs"))
    for name in ("__init__.py", "_c.py", "_mesh.py", "_scene.py", "_textures.py", "py.typed"):
        shutil.copyfile(os.path.join(here, "quoin", name), os.path.join(package, name))
    interface = os.path.join(package, "libquoin_c.so.0")
    subprocess.run(["strip", "-o", interface, library], check=True)
    for name, path in needed(library):
        shutil.copyfile(path, os.path.join(package, "libs", name))
        owner, text = copyright_of(path)
        shutil.copyfile(text, os.path.join(licences, owner))
    for name in ("LICENSE", "NOTICE"):
        shutil.copyfile(os.path.join(here, "../..", name), os.path.join(licences, name))
    with open(os.path.join(info, "METADATA"), "w") as file:
        file.write(f"Metadata-Version: 2.1\nName: quoin\nVersion: {version}\nRequires-Python: >=3.8\n"
                   "Requires-Dist: numpy\nProvides-Extra: trimesh\nRequires-Dist: trimesh; extra == 'trimesh'\n"
                   "Summary: Voxels as files, NumPy arrays, meshes and images\n")
    with open(os.path.join(info, "WHEEL"), "w") as file:
        file.write("Wheel-Version: 1.0\nGenerator: quoin\nRoot-Is-Purelib: false\nTag: py3-none-linux_x86_64\n")


def pack(folder, wheel, version):
    record = []
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as out:
        for at, _, names in sorted(os.walk(folder)):
            for name in sorted(names):
                path = os.path.join(at, name)
                inside = os.path.relpath(path, folder)
                with open(path, "rb") as file:
                    data = file.read()
                digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
                record.append(f"{inside},sha256={digest},{len(data)}")
                out.writestr(zipfile.ZipInfo(inside, (2026, 1, 1, 0, 0, 0)), data, zipfile.ZIP_DEFLATED)
        name = f"quoin-{version}.dist-info/RECORD"
        out.writestr(zipfile.ZipInfo(name, (2026, 1, 1, 0, 0, 0)), "\n".join(record + [f"{name},,"]) + "\n")


def main():
    library, version, to = sys.argv[1:]
    os.makedirs(to, exist_ok=True)
    wheel = os.path.join(to, f"quoin-{version}-py3-none-linux_x86_64.whl")
    with tempfile.TemporaryDirectory() as folder:
        fill(folder, library, version)
        pack(folder, wheel + ".new", version)
    os.replace(wheel + ".new", wheel)
    print(wheel)


if __name__ == "__main__":
    main()
