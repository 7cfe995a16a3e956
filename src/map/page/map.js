'use strict';
// Shows the tiles of a folder that `quoin map` wrote. Works opened as a file: all data comes from scripts and images.
(function () {
  // Pixels are voxels at this zoom (kMapZoom in world_map.h). Leaflet counts from there: lower ones are negative.
  const lastZoom = 18;
  const closest = 4;
  const transparent = 'data:image/gif;base64,R0lGODlhAQABAIAAAAAAAP///yH5BAEAAAAALAAAAAABAAEAAAIBRAA7';
  const layers = window.quoinLayers || [];
  const markers = window.quoinMarkers || {};
  const element = (id) => document.getElementById(id);

  // x grows to the right and z downwards; Leaflet's first coordinate is the vertical one.
  const crs = L.extend({}, L.CRS.Simple, {transformation: new L.Transformation(1, 0, 1, 0)});
  const map = L.map('map', {crs, zoomSnap: 1, attributionControl: true, minZoom: -lastZoom, maxZoom: closest});
  map.attributionControl.setPrefix('<a href="https://leafletjs.com">Leaflet</a>');

  let current = null;  // the layer
  let shown = null;    // its tiles
  const marks = L.layerGroup().addTo(map);
  let areMarksShown = true;

  function isDark() {
    return document.documentElement.classList.contains('dark');
  }
  function setDark(dark) {
    document.documentElement.classList.toggle('dark', dark);
    element('dark').textContent = dark ? 'Light' : 'Dark';
  }

  function boundsOf([x0, z0, x1, z1]) {
    return L.latLngBounds([z0, x0], [z1, x1]);
  }

  // Text of worlds is not trusted: it never becomes HTML.
  function textElement(text) {
    const box = document.createElement('div');
    box.textContent = text;
    return box;
  }

  // Only markers in view, and not more than a phone can draw.
  const mostMarkers = 400;
  function addMarkers() {
    marks.clearLayers();
    if (!current || !areMarksShown) return;
    const view = map.getBounds().pad(0.1);
    const inView = (markers[current.key] || []).filter(({x, z}) => view.contains([z, x]));
    for (const {x, z, y, text, kind} of inView.slice(0, mostMarkers)) {
      const size = kind === 'spawn' ? 18 : 12;
      const icon = L.divIcon({className: 'marker ' + (kind === 'spawn' ? 'spawn' : 'sign'), iconSize: [size, size]});
      const place = '(' + x + ', ' + y + ', ' + z + ')';
      L.marker([z + 0.5, x + 0.5], {icon, title: text.split('\n')[0], keyboard: true})
        .bindPopup(textElement(text + '\n' + place), {autoPan: false})
        .addTo(marks);
    }
  }

  function show(layer, view) {
    if (shown) shown.remove();
    current = layer;
    document.title = layer.world ? layer.world + ' – map' : 'Map';
    shown = L.tileLayer(layer.tiles + '/{z}/{x}/{y}.' + layer.extension, {
      bounds: boundsOf(layer.bounds),
      minNativeZoom: layer.zooms[0] - lastZoom,
      maxNativeZoom: 0,
      minZoom: -lastZoom,
      maxZoom: closest,
      zoomOffset: lastZoom,
      errorTileUrl: transparent,
      noWrap: true,
    }).addTo(map);
    map.setMinZoom(layer.zooms[0] - lastZoom - 2);
    map.setMaxBounds(boundsOf(layer.bounds).pad(1));
    if (view) {
      map.setView([view.z, view.x], view.zoom, {animate: false});
    } else if (layer.spawn) {
      map.setView([layer.spawn[2], layer.spawn[0]], 0, {animate: false});
    } else {
      map.fitBounds(boundsOf(layer.content), {animate: false, maxZoom: 2});
    }
    element('layers').value = layer.key;
    addMarkers();
    writeAddress();
  }

  // The address: #LAYER/ZOOM/X/Z.
  function readAddress() {
    let text = '';
    try {
      text = decodeURIComponent(location.hash.slice(1));
    } catch (error) { /* an address that was cut off */ }
    const [key, zoom, x, z] = text.split('/');
    const layer = layers.find((each) => each.key === key);
    const numbers = [zoom, x, z].map(Number);
    const farthest = 2 ** 31;
    const isPlace = z !== undefined && numbers.every((number) => Math.abs(number) <= farthest);
    if (!layer || !isPlace) return {layer, view: null};
    const nearest = Math.min(Math.max(numbers[0], layer.zooms[0] - lastZoom - 2), closest);
    return {layer, view: {zoom: nearest, x: numbers[1], z: numbers[2]}};
  }
  function writeAddress() {
    if (!current) return;
    const at = map.getCenter();
    const place = [map.getZoom(), Math.floor(at.lng), Math.floor(at.lat)];
    const address = '#' + [encodeURIComponent(current.key), ...place].join('/');
    if (address === location.hash) return;
    try {
      history.replaceState(null, '', address);
    } catch (error) {
      location.replace(address);  // where files have no history
    }
  }

  function showPlace(at) {
    element('place').textContent = 'x ' + Math.floor(at.lng) + ', z ' + Math.floor(at.lat);
  }

  if (layers.length === 0) {
    element('place').textContent = 'The map has no tiles.';
    return;
  }
  for (const layer of layers) {
    const option = document.createElement('option');
    option.value = layer.key;
    option.textContent = layer.name;
    element('layers').append(option);
  }
  element('layers').hidden = layers.length < 2;
  element('layers').addEventListener('change', (event) => {
    show(layers.find((each) => each.key === event.target.value), null);
  });
  element('dark').addEventListener('click', () => {
    setDark(!isDark());
    try {
      localStorage.setItem('quoin-map-dark', String(isDark()));
    } catch (error) { /* some browsers keep nothing for files */ }
  });
  element('markers').addEventListener('click', (event) => {
    areMarksShown = !areMarksShown;
    event.target.setAttribute('aria-pressed', String(areMarksShown));
    addMarkers();
  });
  let wish = null;
  try {
    wish = localStorage.getItem('quoin-map-dark');
  } catch (error) { /* as above */ }
  setDark(wish === null ? window.matchMedia('(prefers-color-scheme: dark)').matches : wish === 'true');

  map.on('mousemove click', (event) => showPlace(event.latlng));
  map.on('move', () => showPlace(map.getCenter()));
  map.on('moveend zoomend', writeAddress);
  map.on('moveend', () => document.querySelector('.leaflet-popup') || addMarkers());
  map.on('zoomend', () => element('map').classList.toggle('smooth', map.getZoom() < 0));
  window.addEventListener('hashchange', () => {
    const {layer, view} = readAddress();
    if (layer) show(layer, view);
  });
  const {layer, view} = readAddress();
  show(layer || layers[0], view);
  window.quoinMap = map;  // for scripts and tests
})();
