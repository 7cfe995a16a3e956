"""Converts Blender's collections to groups and layers, and finds hidden objects."""

import json

LAYER = "layer"  # the property of objects and collections that names their layer
FILE = "quoin_file"  # marks the collection of an import, which is not a group of the file
CAMERA = "quoin_camera"  # a camera's number in its file
_LAYERS = "quoin_layers"  # on the collection of an import: the file's layers


def set_layers(collection, layers):
    """Stores a file's layers and their visibility."""
    if layers:
        collection[_LAYERS] = json.dumps([[one.name, one.visible] for one in layers])


def layers_of(scene):
    """Returns the visibility of all imported layers, by name."""
    found = {}
    for collection in scene.collection.children_recursive:
        if _LAYERS in collection:
            for name, visible in json.loads(collection[_LAYERS]):
                found.setdefault(name, visible)
    return found


def layer_of(thing):
    """Returns the layer name of an object or collection; empty: none."""
    found = thing.get(LAYER)
    return found if isinstance(found, str) else ""


def hides_itself(source):
    """Returns true if an object's own flags hide it."""
    return source.hide_render or source.hide_viewport or source.hide_get()


class Tree:
    """The collections of a scene: each object's path and visibility."""

    def __init__(self, view_layer):
        self.path_of = {}  # collections of each object, from the top, without the scene collection
        self._hides = {}  # by collection name: true if it hides its contents
        self._walk(view_layer.layer_collection, ())

    def _walk(self, layer, path):
        collection = layer.collection
        hides = layer.exclude or collection.hide_render or collection.hide_viewport or layer.hide_viewport
        self._hides[collection.name_full] = hides
        for one in collection.objects:
            # If an object is in several collections, use the first visible one.
            known = self.path_of.get(one.name_full)
            if known is None or (self.is_hidden(known) and not self.is_hidden(path)):
                self.path_of[one.name_full] = path
        for child in layer.children:
            self._walk(child, path + (child.collection,))

    def hides(self, collection):
        """Returns true if the collection's own flags hide its contents."""
        return self._hides.get(collection.name_full, False)

    def is_hidden(self, path):
        """Returns true if any collection of a path hides its contents."""
        return any(self.hides(one) for one in path)

    def is_hidden_object(self, source):
        """Returns true if an object's own flags or its collections hide it."""
        return hides_itself(source) or self.is_hidden(self.path(source))

    def path(self, source):
        """Returns the collections of an object, from the top; empty for objects of the scene collection."""
        return self.path_of.get(source.name_full, ())


class Belonging:
    """Creates groups and layers of a Quoin scene on first use."""

    def __init__(self, scene, blender_scene, tree, how, shown):
        self._scene = scene
        self._tree = tree
        self._how = how  # "GROUPS", "LAYERS" or "NONE"
        self._groups = {}
        self._made_layers = set()
        self._layers = layers_of(blender_scene)  # visibility by name
        # A layer with visible objects is visible.
        for one in shown:
            for name in [self._layer(one), *map(layer_of, self._path(one))]:
                self._layers[name] = True

    def _path(self, source):
        # Collections that represent a file or a layer are not groups.
        path = [one for one in self._tree.path(source) if FILE not in one]
        if self._how == "LAYERS":
            path = path[1:]
        return path if self._how != "NONE" else []

    def _layer(self, source):
        if layer_of(source):
            return layer_of(source)
        path = [one for one in self._tree.path(source) if FILE not in one]
        if self._how != "LAYERS" or not path:
            return ""
        self._layers.setdefault(path[0].name, not self._tree.hides(path[0]))
        return path[0].name

    def _shows_layer(self, name):
        return self._layers.get(name, True)

    def _need_layer(self, name):
        if name and name not in self._made_layers:
            self._made_layers.add(name)
            self._scene.set_layer(name, self._shows_layer(name))
        return name

    def _group(self, path):
        parent = None
        for depth in range(len(path)):
            key = tuple(one.name_full for one in path[: depth + 1])
            if key not in self._groups:
                collection = path[depth]
                layer = layer_of(collection) if self._how == "GROUPS" else ""
                self._groups[key] = self._scene.add_group(
                    collection.name, parent, not self._tree.hides(collection), self._need_layer(layer))
            parent = self._groups[key]
        return parent

    def add(self, number, source, is_hidden):
        """Assigns an instance to an object's group and layer. Returns the instance's own visibility flag."""
        path, layer = self._path(source), self._layer(source)
        if path or layer:
            self._scene.assign(number, self._group(path), self._need_layer(layer))
        if not is_hidden:
            return True
        hidden_by_layer = any(one and not self._shows_layer(one) for one in [layer, *map(layer_of, path)])
        return hidden_by_layer or (self._tree.is_hidden(path) and not hides_itself(source))
