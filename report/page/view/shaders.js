// What the graphics card computes: solids under a soft light, see-through ghosts, and a floor with a grid.

var SOLID_VERTEX = [
  '#version 300 es',
  'in vec3 position; in vec3 normal;',
  'uniform mat4 camera; uniform mat4 model; uniform vec3 size;',
  'out vec3 world; out vec3 facing;',
  'void main() {',
  '  vec4 at = model * vec4(position, 1.0);',
  '  world = at.xyz;',
  // A model turns and scales: what is at right angles stays so if it is divided by the scale twice.
  '  facing = mat3(model) * (normal / (size * size));',
  '  gl_Position = camera * at;',
  '}'
].join('\n');

var SOLID_FRAGMENT = [
  '#version 300 es',
  'precision highp float;',
  'in vec3 world; in vec3 facing;',
  'uniform vec4 colour; uniform vec3 eye; uniform vec3 light; uniform float ghost; uniform float flatness;',
  'out vec4 seen;',
  'void main() {',
  '  if (flatness > 0.5) { seen = vec4(colour.rgb * colour.a, colour.a); return; }',
  '  vec3 n = normalize(facing), v = normalize(eye - world);',
  '  if (dot(n, v) != abs(dot(n, v))) { n = -n; }',
  '  float sky = 0.5 + 0.5 * n.z, key = max(dot(n, light), 0.0);',
  '  vec3 lit = colour.rgb * (0.42 + 0.2 * sky + 0.48 * key);',
  '  lit += 0.12 * pow(max(dot(reflect(-light, n), v), 0.0), 24.0);',
  '  float rim = pow(1.0 - abs(dot(n, v)), 2.0);',
  '  float opacity = ghost > 0.5 ? mix(0.38, 0.9, rim) : colour.a;',
  '  lit = ghost > 0.5 ? mix(lit, colour.rgb, 0.4) : lit;',
  '  seen = vec4(lit * opacity, opacity);',
  '}'
].join('\n');

var FLOOR_FRAGMENT = [
  '#version 300 es',
  'precision highp float;',
  'in vec3 world;',
  'uniform vec4 colour; uniform vec4 ruled; uniform vec3 middle; uniform float reach; uniform float cell;',
  'out vec4 seen;',
  'float line(vec2 at, float width) {',
  '  vec2 near = abs(fract(at - 0.5) - 0.5) / fwidth(at);',
  '  return 1.0 - min(min(near.x, near.y) / width, 1.0);',
  '}',
  'void main() {',
  '  float fade = 1.0 - smoothstep(0.45, 1.0, length(world.xy - middle.xy) / reach);',
  '  float grid = max(0.55 * line(world.xy / cell, 1.1), line(world.xy / (5.0 * cell), 1.4));',
  '  vec4 ground = mix(colour, vec4(ruled.rgb, max(colour.a, ruled.a)), grid * ruled.a);',
  '  float opacity = fade * mix(colour.a, 1.0, grid * ruled.a);',
  '  seen = vec4(ground.rgb * opacity, opacity);',
  '}'
].join('\n');

function program(gl, vertex, fragment) {
  var made = gl.createProgram();
  [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]].forEach(function (part) {
    var shader = gl.createShader(part[0]);
    gl.shaderSource(shader, part[1]);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) { throw new Error(gl.getShaderInfoLog(shader)); }
    gl.attachShader(made, shader);
  });
  gl.bindAttribLocation(made, 0, 'position');
  gl.bindAttribLocation(made, 1, 'normal');
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) { throw new Error(gl.getProgramInfoLog(made)); }
  var places = {}, count = gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS);
  for (var i = 0; i !== count; i++) {
    var name = gl.getActiveUniform(made, i).name;
    places[name] = gl.getUniformLocation(made, name);
  }
  return { program: made, places: places };
}

// Sets the uniforms of a program by the number of their entries.
function set(gl, made, values) {
  Object.keys(values).forEach(function (name) {
    var place = made.places[name], value = values[name];
    if (!place) { return; }
    if (typeof value === 'number') { gl.uniform1f(place, value); }
    else if (value.length === 3) { gl.uniform3fv(place, value); }
    else if (value.length === 4) { gl.uniform4fv(place, value); }
    else { gl.uniformMatrix4fv(place, false, value); }
  });
}

// Triangles on the card.
function upload(gl, triangles) {
  var array = gl.createVertexArray(), buffers = [];
  gl.bindVertexArray(array);
  ['position', 'normal'].forEach(function (name, i) {
    var buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(triangles[name]), gl.STATIC_DRAW);
    gl.enableVertexAttribArray(i);
    gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 0, 0);
    buffers.push(buffer);
  });
  return { array: array, buffers: buffers, count: triangles.position.length / 3 };
}

function discard(gl, uploaded) {
  uploaded.buffers.forEach(function (buffer) { gl.deleteBuffer(buffer); });
  gl.deleteVertexArray(uploaded.array);
}
