#!/usr/bin/env python3
"""Repeats the finished chunks of a Minecraft region in a world of many regions, to measure maps of large worlds.

    repeat_region.py REGION.mca WORLD [REGIONS]

WORLD/region gets REGIONS (64) files in a square, each with 1,024 chunks: those of REGION that are finished (generated
to the end; worlds before 1.13 have no other ones), one after the other, each with its own copy. Prints a line of JSON:
the number of chunks and the bytes of the world.
"""
import json
import math
import os
import struct
import sys
import zlib

SECTOR = 4096


def chunks_of(region):
    """Yields the stored bytes of the region's chunks, with their header."""
    for i in range(1024):
        entry = int.from_bytes(region[4 * i:4 * i + 4], 'big')
        at = (entry >> 8) * SECTOR
        if entry == 0 or at + 5 > len(region):
            continue
        size = int.from_bytes(region[at:at + 4], 'big')
        yield region[at:at + 4 + size]


def is_finished(chunk):
    """Returns true for a chunk whose generation has ended."""
    nbt = zlib.decompress(chunk[5:]) if chunk[4] == 2 else chunk[5:]
    name = b'\x08\x00\x06Status'
    at = nbt.find(name)
    if at < 0:
        return b'TerrainPopulated\x00' not in nbt
    at += len(name)
    size = int.from_bytes(nbt[at:at + 2], 'big')
    return nbt[at + 2:at + 2 + size].decode().removeprefix('minecraft:') in ('full', 'fullchunk', 'postprocessed',
                                                                               'mobs_spawned')


def region_of(chunks, first):
    """Returns a region file with 1,024 chunks, from number `first` on."""
    table = bytearray(2 * SECTOR)
    parts = [table]
    sector = 2
    for i in range(1024):
        chunk = chunks[(first + i) % len(chunks)]
        count = -(-len(chunk) // SECTOR)
        struct.pack_into('>I', table, 4 * i, sector << 8 | count)
        struct.pack_into('>I', table, SECTOR + 4 * i, 1_500_000_000)
        parts.append(chunk.ljust(count * SECTOR, b'\0'))
        sector += count
    return b''.join(parts)


def main():
    if len(sys.argv) not in (3, 4):
        sys.exit(__doc__)
    with open(sys.argv[1], 'rb') as file:
        chunks = [chunk for chunk in chunks_of(file.read()) if is_finished(chunk)]
    if not chunks:
        sys.exit(f'{sys.argv[1]}: no finished chunk')
    regions = int(sys.argv[3]) if len(sys.argv) == 4 else 64
    edge = math.isqrt(regions - 1) + 1
    folder = os.path.join(sys.argv[2], 'region')
    os.makedirs(folder, exist_ok=True)
    size = 0
    for i in range(regions):
        x, z = i % edge - edge // 2, i // edge - edge // 2
        content = region_of(chunks, i * 1024)
        size += len(content)
        with open(os.path.join(folder, f'r.{x}.{z}.mca'), 'wb') as file:
            file.write(content)
    print(json.dumps({'finished': len(chunks), 'chunks': regions * 1024, 'bytes': size}))


if __name__ == '__main__':
    main()
