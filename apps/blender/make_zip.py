"""Packs the Blender add-on with the Python package and its library. Usage: make_zip.py WHEEL FOLDER

Like the wheel, the zip is for Linux on x86-64. Both must have the same version.
"""

import os
import sys
import zipfile

HERE = os.path.dirname(os.path.abspath(__file__))
NAME = "quoin_voxels"


def require_version(version):
    """Checks that the add-on's files state the package's version."""
    for name, wanted in (("__init__.py", f'"version": ({version.replace(".", ", ")}),'),
                         ("blender_manifest.toml", f'\nversion = "{version}"\n')):
        with open(os.path.join(HERE, NAME, name)) as file:
            if wanted not in file.read():
                raise SystemExit(f"make_zip: {name} does not have the version {version}")


def main():
    wheel, folder = sys.argv[1:]
    os.makedirs(folder, exist_ok=True)
    version = os.path.basename(wheel).split("-")[1]
    require_version(version)
    path = os.path.join(folder, f"{NAME}-{version}.zip")
    when = (2026, 1, 1, 0, 0, 0)
    with zipfile.ZipFile(path + ".new", "w", zipfile.ZIP_DEFLATED) as out:
        # With a folder entry, Blender removes an older version before it installs this one. Otherwise it would
        # overwrite the loaded library.
        folder_entry = zipfile.ZipInfo(f"{NAME}/", when)
        folder_entry.external_attr = 0o40755 << 16 | 0x10
        out.writestr(folder_entry, b"")
        for name in sorted(os.listdir(os.path.join(HERE, NAME))):
            if name.endswith((".py", ".toml")):
                with open(os.path.join(HERE, NAME, name), "rb") as file:
                    out.writestr(zipfile.ZipInfo(f"{NAME}/{name}", when), file.read(), zipfile.ZIP_DEFLATED)
        with zipfile.ZipFile(wheel) as package:
            for name in sorted(package.namelist()):
                # Of the pip metadata, keep only the licences.
                kept = name if name.startswith("quoin/") else name[name.index("/") + 1:]
                if name.startswith("quoin/") or "/licenses/" in name:
                    out.writestr(zipfile.ZipInfo(f"{NAME}/{kept}", when), package.read(name), zipfile.ZIP_DEFLATED)
    os.replace(path + ".new", path)
    print(path)


if __name__ == "__main__":
    main()
