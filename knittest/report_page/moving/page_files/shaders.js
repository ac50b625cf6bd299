// Shaders: yarns are capsules that every pixel meets exactly, shells are quadrangles, tools are triangles.

const COMMON = `
precision highp float; precision highp sampler2D;
uniform sampler2D placeA, placeB, placeFirst; uniform float between; uniform int colourBy; uniform vec2 span;
vec3 at(sampler2D place, float node) { int k = int(node + 0.5); return texelFetch(place, ivec2(k & 2047, k >> 11), 0).xyz; }
vec3 now(float node) { return mix(at(placeA, node), at(placeB, node), between); }
float ofNode(float node, vec3 p) { return ((colourBy == 1 ? p.z : distance(p, at(placeFirst, node))) - span.x) / (span.y - span.x); }
float ofElement(vec2 codes) {
  vec2 c = codes * 255.0;
  return c.x < 0.5 || c.y < 0.5 ? -1.0 : (mix(c.x, c.y, between) - 1.0) / 254.0;
}`;

const LIT = `
precision highp float;
uniform sampler2D colours; uniform int colourBy; uniform vec3 partColours[8];
vec3 coloured(float value, float part) {
  if (colourBy == 3) return partColours[int(part + 0.5) & 7];
  return value < 0.0 && colourBy == 0 ? vec3(0.55) : texture(colours, vec2((clamp(value, 0.0, 1.0) * 255.0 + 0.5) / 256.0, 0.5)).rgb;
}
vec3 lit(vec3 colour, vec3 normal) {
  float light = 0.5 + 0.5 * max(dot(normal, normalize(vec3(-0.35, 0.5, 0.8))), 0.0);
  return colour * light * (0.62 + 0.38 * smoothstep(0.0, 0.55, normal.z)) * 1.04;
}`;

export const YARN = {
  vertex: COMMON + `
in vec2 ends; in vec3 kind; in vec2 codes; in vec2 alive; uniform float partShown[8];
flat out vec3 a, b; flat out vec4 look; out vec2 place;
void main() {
  vec3 wa = now(ends.x), wb = now(ends.y);
  a = (viewMatrix * vec4(wa, 1.0)).xyz; b = (viewMatrix * vec4(wb, 1.0)).xyz;
  float r = kind.x, value = ofElement(codes), other = value;
  if (colourBy == 1 || colourBy == 2) { value = ofNode(ends.x, wa); other = ofNode(ends.y, wb); }
  look = vec4(r, value, other, kind.y);
  vec2 along = b.xy - a.xy; float l = length(along); along = l > 1e-6 ? along / l : vec2(1.0, 0.0);
  place = (position.x < 0.0 ? a.xy - along * r : b.xy + along * r) + vec2(-along.y, along.x) * position.y * r;
  bool shown = alive.x > 0.5 && partShown[int(kind.y + 0.5) & 7] > 0.5;
  gl_Position = shown ? projectionMatrix * vec4(place, max(a.z, b.z) + r, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
}`,
  fragment: LIT + `
uniform mat4 projectionMatrix; flat in vec3 a, b; flat in vec4 look; in vec2 place; out vec4 shown;
void main() {  // a ray along z meets the capsule about a-b: body first, then the nearer of its round ends
  float r = look.x; vec3 ba = b - a; vec2 o = place - a.xy;
  float aa = dot(ba.xy, ba.xy), bb = dot(ba, ba), s = 0.0, rise = -1.0, z = 0.0; vec3 axis = a;
  if (aa > 1e-9 * bb) {
    float across = (o.x * ba.y - o.y * ba.x);
    float q = r * r - across * across / aa;
    if (q < 0.0) discard;
    float along = dot(o, ba.xy) / aa;              // share of the axis that lies under the pixel
    float up = sqrt(q * bb / aa);                  // height of the surface over the axis, along z
    s = along + up * ba.z / bb;                    // foot of the surface point on the axis
    z = a.z + along * ba.z + up;
    if (s >= 0.0 && s <= 1.0) { axis = a + s * ba; rise = 1.0; }
  }
  if (rise < 0.0) {
    float best = -1e9;
    for (int k = 0; k < 2; k++) {
      vec3 end = k == 0 ? a : b; vec2 off = place - end.xy; float h = r * r - dot(off, off);
      if (h >= 0.0 && end.z + sqrt(h) > best) { best = end.z + sqrt(h); axis = end; s = float(k); }
    }
    if (best < -1e8) discard;
    z = best;
  }
  vec3 normal = (vec3(place, z) - axis) / r;
  shown = vec4(lit(coloured(mix(look.y, look.z, clamp(s, 0.0, 1.0)), look.w), normal), 1.0);
  gl_FragDepth = 0.5 * (projectionMatrix[2][2] * z + projectionMatrix[3][2]) + 0.5;
}`,
};

export const SHELL = {
  vertex: COMMON + `
in vec4 corners; in vec3 kind; in vec2 codes; in vec2 alive; uniform float partShown[8]; uniform sampler2D normalA, normalB;
out float value; flat out float part; out vec3 facing; out vec2 uv_;
void main() {
  int c = int(position.z + 0.5);
  float node = corners[c]; vec3 p = now(node);
  value = colourBy == 0 ? ofElement(codes) : ofNode(node, p);
  part = kind.y; uv_ = position.xy;
  facing = (viewMatrix * vec4(mix(at(normalA, node), at(normalB, node), between), 0.0)).xyz;
  bool shown = alive.x > 0.5 && partShown[int(kind.y + 0.5) & 7] > 0.5;
  gl_Position = shown ? projectionMatrix * viewMatrix * vec4(p, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
}`,
  fragment: LIT + `
in float value; flat in float part; in vec3 facing; in vec2 uv_; out vec4 shown;
void main() {
  vec3 n = normalize(facing); n = n.z < 0.0 ? -n : n;
  vec2 width = fwidth(uv_), off = min(uv_, 1.0 - uv_) / width;
  float line = (1.0 - smoothstep(0.2, 1.0, min(off.x, off.y))) * (1.0 - smoothstep(0.1, 0.3, max(width.x, width.y)));
  shown = vec4(lit(coloured(value, part), n) * (1.0 - 0.28 * line), 1.0);
}`,
};

export const TOOL = {
  vertex: `precision highp float; out vec3 eye;
void main() { vec4 p = modelViewMatrix * vec4(position, 1.0); eye = p.xyz; gl_Position = projectionMatrix * p; }`,
  fragment: `precision highp float; uniform vec3 colour; uniform float opacity; in vec3 eye; out vec4 shown;
void main() {
  vec3 n = normalize(cross(dFdx(eye), dFdy(eye)));
  shown = vec4(colour * (0.55 + 0.45 * abs(dot(n, normalize(vec3(-0.35, 0.5, 0.8))))), opacity);
}`,
};
