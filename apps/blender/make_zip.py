"""Puts the add-on for Blender into a zip, with the package for Python and its library. Usage: make_zip.py WHEEL FOLDER

It is for Linux on x86-64, as the wheel is. Both are of one version.
"""

import os
import sys
import zipfile

HERE = os.path.dirname(os.path.abspath(__file__))
NAME = "quoin_voxels"


def require_version(version):
    """What Blender is told of the version is that of the package."""
    for name, wanted in (("__init__.py", f'"version": ({version.replace(".", ", ")}),'),
                         ("blender_manifest.toml", f'\nversion = "{version}"\n')):
        with open(os.path.join(HERE, NAME, name)) as file:
            if wanted not in file.read():
                raise SystemExit(f"make_zip: {name} is of another version than {version}")


def main():
    wheel, folder = sys.argv[1:]
    os.makedirs(folder, exist_ok=True)
    version = os.path.basename(wheel).split("-")[1]
    require_version(version)
    path = os.path.join(folder, f"{NAME}-{version}.zip")
    when = (2026, 1, 1, 0, 0, 0)
    with zipfile.ZipFile(path + ".new", "w", zipfile.ZIP_DEFLATED) as out:
        # By its folder Blender knows what to remove first when it is installed over another version: else it would write
        # into the library that it has loaded.
        folder_entry = zipfile.ZipInfo(f"{NAME}/", when)
        folder_entry.external_attr = 0o40755 << 16 | 0x10
        out.writestr(folder_entry, b"")
        for name in sorted(os.listdir(os.path.join(HERE, NAME))):
            if name.endswith((".py", ".toml")):
                with open(os.path.join(HERE, NAME, name), "rb") as file:
                    out.writestr(zipfile.ZipInfo(f"{NAME}/{name}", when), file.read(), zipfile.ZIP_DEFLATED)
        with zipfile.ZipFile(wheel) as package:
            for name in sorted(package.namelist()):
                # Of what pip needs to know only the licences are of use here.
                kept = name if name.startswith("quoin/") else name[name.index("/") + 1:]
                if name.startswith("quoin/") or "/licenses/" in name:
                    out.writestr(zipfile.ZipInfo(f"{NAME}/{kept}", when), package.read(name), zipfile.ZIP_DEFLATED)
    os.replace(path + ".new", path)
    print(path)


if __name__ == "__main__":
    main()
