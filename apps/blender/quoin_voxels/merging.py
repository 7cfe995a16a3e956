"""Merges similar colours if a format limits the number of types."""

import numpy as np

MOST_TYPES = {".vox": 255}  # by extension


class _Box:
    """Types that differ only in colour."""

    def __init__(self, numbers, colours, counts):
        self.numbers, self._colours, self._counts = numbers, colours, counts
        self._mean = np.average(colours, axis=0, weights=counts)
        off = (colours - self._mean) ** 2 * counts[:, None]
        self._errors = off.sum(0)
        self.error = float(self._errors.sum())

    def split(self):
        axis = int(self._errors.argmax())
        high = self._colours[:, axis] > self._mean[axis]
        return [_Box(self.numbers[side], self._colours[side], self._counts[side]) for side in (high, ~high)]

    def middle(self):
        """Returns the type nearest to the mean colour."""
        return self.numbers[((self._colours - self._mean) ** 2).sum(1).argmin()]


def _boxes(types, used, counts, most):
    kinds = {}
    for number in used:
        one = types[number]
        kinds.setdefault((one.rgba[3], *one[2:]), []).append(number)
    if len(kinds) > most:  # they differ in more than colour; the library then reports the error
        return None
    # Weighted by perceived brightness.
    colours = np.array([one.rgba[:3] for one in types], float) * np.sqrt([0.3, 0.59, 0.11])
    boxes = [_Box(np.array(one), colours[one], counts[one].astype(float)) for one in kinds.values()]
    while len(boxes) < most:
        boxes.sort(key=lambda box: box.error)
        if boxes[-1].error == 0.0:
            break
        boxes += boxes.pop().split()
    return boxes


def merge(scene, ending):
    """Merges a Quoin scene's types down to the format's limit. Returns the number of types before; 0: not merged."""
    types = scene.types
    most = MOST_TYPES.get(ending, len(types))
    if len(types) - 1 <= most:
        return 0
    grids = [one for one in scene.grids if one.voxel_count]
    counts = sum(np.bincount(one.to_numpy().ravel(), minlength=len(types)) for one in grids)
    used = [int(number) for number in np.flatnonzero(counts) if number]
    boxes = _boxes(types, used, counts, most) if len(used) > most else None
    if boxes is None:
        return 0
    becomes = np.arange(len(types)).astype(np.uint16)
    for box in boxes:
        becomes[box.numbers] = box.middle()
    for grid in grids:
        grid.write(becomes[grid.to_numpy()])
    return len(used)
