// Scene of a run: instanced yarns or shells that read the positions of two frames, and the tools.
import * as THREE from "three";
import { SHELL, TOOL, YARN } from "shaders";
import { unpacked } from "decode";

const WIDE = 2048;  // nodes in a row of a texture
const PARTS = [0x3b76b4, 0xd9822b, 0x4b9b57, 0x8a63b0, 0xb04a5a, 0x6b7480, 0x2aa3a3, 0xb3a12c];

export class RunScene {
  constructor(header, data) {
    this.header = header;
    this.scene = new THREE.Scene();
    [this.frames, this.nodes] = header.position.shape;
    this.whole = unpacked(data, header.position, Uint16Array);
    this.cells = unpacked(data, header.cells, Int32Array);
    this.alive = unpacked(data, header.alive, Uint8Array);
    this.codes = header.fields.map(field => unpacked(data, field.codes, Uint8Array));
    this.count = header.cells.shape[1];
    this.box = this.bounds();
    this.uniforms = this.makeUniforms();
    const radius = unpacked(data, header.radius, Int32Array);
    this.radius = radius.reduce((most, r) => Math.max(most, r), 0) / 1000;
    this.mesh = this.makeMesh(radius);
    this.scene.add(this.mesh);
    this.tools = header.bodies.map(body => this.makeTool(body, data));
    this.room = this.withTools();
    this.shownA = this.shownB = -1;
    this.write(this.uniforms.placeFirst.value, 0);
    this.colourBy(0);
    this.show(0, 0, 0);
  }

  makeTexture() {
    const high = Math.ceil(this.nodes / WIDE);
    return new THREE.DataTexture(new Float32Array(4 * WIDE * high), WIDE, high, THREE.RGBAFormat, THREE.FloatType);
  }

  makeUniforms() {
    const table = new THREE.DataTexture(new Uint8Array(4 * 256), 256, 1);
    const value = {
      placeA: this.makeTexture(), placeB: this.makeTexture(), placeFirst: this.makeTexture(), between: 0, colourBy: 0,
      span: new THREE.Vector2(0, 1), colours: table, partShown: new Array(8).fill(1),
      partColours: PARTS.map(c => { const k = new THREE.Color(); k.setHex(c, THREE.LinearSRGBColorSpace); return k; }),
    };
    if (this.header.kind === "shells") Object.assign(value, { normalA: this.makeTexture(), normalB: this.makeTexture() });
    return Object.fromEntries(Object.entries(value).map(([name, v]) => [name, { value: v }]));
  }

  makeMesh(radius) {
    const beams = this.header.kind === "beams", ends = beams ? 2 : 4, row = ends + 1, n = this.count;
    const geometry = new THREE.InstancedBufferGeometry();
    const flat = beams ? [-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, 1, 0] : [0, 0, 0, 1, 0, 1, 1, 1, 2, 0, 1, 3];
    geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(flat), 3));
    geometry.setIndex([0, 1, 2, 0, 2, 3]);
    const nodes = new Float32Array(n * ends), kind = new Float32Array(n * 3);
    for (let e = 0; e < n; e++) {
      for (let k = 0; k < ends; k++) nodes[e * ends + k] = this.cells[e * row + k];
      kind[3 * e] = radius[e] / 1000;
      kind[3 * e + 1] = this.cells[e * row + ends];
    }
    const add = (name, array, size, normalized) =>
      geometry.setAttribute(name, new THREE.InstancedBufferAttribute(array, size, normalized));
    add(beams ? "ends" : "corners", nodes, ends, false);
    add("kind", kind, 3, false);
    add("codes", new Uint8Array(2 * n), 2, true);
    add("alive", new Float32Array(2 * n), 2, false);
    geometry.instanceCount = n;
    const { vertex, fragment } = beams ? YARN : SHELL;
    const material = new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3, vertexShader: vertex, fragmentShader: fragment, uniforms: this.uniforms, side: THREE.DoubleSide,
    });
    const mesh = new THREE.Mesh(geometry, material);
    mesh.frustumCulled = false;
    return mesh;
  }

  makeTool(body, data) {
    const whole = unpacked(data, body.points, Uint16Array), points = new Float32Array(whole.length);
    for (let k = 0; k < whole.length; k++) points[k] = body.low[k % 3] + body.step * whole[k];
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(points, 3));
    geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(unpacked(data, body.triangles, Int32Array)), 1));
    const uniforms = { opacity: { value: 0.3 }, colour: { value: new THREE.Color(0.55, 0.6, 0.66) } };
    const material = new THREE.ShaderMaterial({
      glslVersion: THREE.GLSL3, vertexShader: TOOL.vertex, fragmentShader: TOOL.fragment, uniforms, side: THREE.DoubleSide,
      transparent: true, depthWrite: false,
    });
    const solid = new THREE.Mesh(geometry, material);
    const lines = new THREE.LineSegments(new THREE.EdgesGeometry(geometry, 25), new THREE.LineBasicMaterial({ color: 0x59636e, transparent: true, opacity: 0.6 }));
    solid.frustumCulled = false;
    solid.renderOrder = 1;
    const group = new THREE.Group();
    group.matrixAutoUpdate = false;
    group.add(solid, lines);
    this.scene.add(group);
    return { name: body.name, group, points: solid.geometry.attributes.position, offset: body.offset, turn: body.turn };
  }

  /** Put a tool where it is a share `between` of the way from frame `a` to frame `b`. */
  place({ group, offset, turn }, a, b, between) {
    const mix = (one, other) => one.map((v, k) => v * (1 - between) + other[k] * between);
    const o = mix(offset[a], offset[b]), m = turn ? mix(turn[a], turn[b]) : [1, 0, 0, 0, 1, 0, 0, 0, 1];
    group.matrix.set(m[0], m[1], m[2], o[0], m[3], m[4], m[5], o[1], m[6], m[7], m[8], o[2], 0, 0, 0, 1);
    group.matrixWorldNeedsUpdate = true;
  }

  /** Corners of the space that the nodes ever take up [mm], and the largest displacement from the first frame. */
  bounds() {
    const { low, step } = this.header, top = [0, 0, 0], n3 = 3 * this.nodes;
    let far = 0;
    for (let k = 0; k < this.whole.length; k++) if (this.whole[k] > top[k % 3]) top[k % 3] = this.whole[k];
    for (let k = 0; k < this.whole.length; k += 3) {
      const f = k % n3, d = [0, 1, 2].map(c => this.whole[k + c] - this.whole[f + c]);
      far = Math.max(far, d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    }
    return { low, high: low.map((v, c) => v + step * top[c]), far: step * Math.sqrt(far) };
  }

  /** Corners of the space that nodes and tools ever take up [mm]. */
  withTools() {
    const low = [...this.box.low], high = [...this.box.high];
    const p = new THREE.Vector3();
    for (const tool of this.tools) {
      for (let frame = 0; frame < this.frames; frame++) {
        this.place(tool, frame, frame, 0);
        for (let k = 0; k < tool.points.count; k++) {
          p.fromBufferAttribute(tool.points, k).applyMatrix4(tool.group.matrix).toArray().forEach((v, c) => {
            low[c] = Math.min(low[c], v);
            high[c] = Math.max(high[c], v);
          });
        }
      }
    }
    return { low, high };
  }

  write(texture, frame) {
    const { low, step } = this.header, to = texture.image.data, from = 3 * this.nodes * frame;
    for (let i = 0; i < this.nodes; i++) {
      for (let c = 0; c < 3; c++) to[4 * i + c] = low[c] + step * this.whole[from + 3 * i + c];
    }
    texture.needsUpdate = true;
  }

  /** Unit normals of the surface at the nodes, means of the elements around them. */
  writeNormals(texture, place) {
    const to = texture.image.data, p = place.image.data;
    to.fill(0);
    for (let e = 0; e < this.count; e++) {
      const [a, b, c, d] = this.cells.subarray(5 * e, 5 * e + 4).map(k => 4 * k);
      const u = [0, 1, 2].map(k => p[c + k] - p[a + k]), v = [0, 1, 2].map(k => p[d + k] - p[b + k]);
      const n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
      for (const corner of [a, b, c, d]) for (let k = 0; k < 3; k++) to[corner + k] += n[k];
    }
    for (let i = 0; i < to.length; i += 4) {
      const size = Math.hypot(to[i], to[i + 1], to[i + 2]) || 1;
      for (let k = 0; k < 3; k++) to[i + k] /= size;
    }
    texture.needsUpdate = true;
  }

  /** Show the state a share `between` of the way from frame `a` to frame `b`. */
  show(a, b, between) {
    const u = this.uniforms;
    for (const [frame, letter] of [[a, "A"], [b, "B"]]) {
      if (this[`shown${letter}`] === frame) continue;
      this.write(u[`place${letter}`].value, frame);
      if (u.normalA) this.writeNormals(u[`normal${letter}`].value, u[`place${letter}`].value);
      this[`shown${letter}`] = frame;
    }
    u.between.value = between;
    const { codes, alive } = this.mesh.geometry.attributes, field = this.codes[this.field];
    for (let e = 0; e < this.count; e++) {
      alive.array[2 * e] = this.alive[a * this.count + e];
      if (!field) continue;
      codes.array[2 * e] = field[a * this.count + e];
      codes.array[2 * e + 1] = field[b * this.count + e];
    }
    codes.needsUpdate = alive.needsUpdate = true;
    for (const tool of this.tools) this.place(tool, a, b, between);
  }

  /** Colour by field number `field`, or by what the positions tell: 1 height, 2 displacement, 3 part. */
  colourBy(field, positions = 0, colours = null, span = [0, 1]) {
    this.field = positions === 0 ? field : -1;
    this.uniforms.colourBy.value = positions;
    this.uniforms.span.value.set(span[0], Math.max(span[1], span[0] + 1e-9));
    if (!colours) return;
    const table = this.uniforms.colours.value, data = table.image.data;
    colours.forEach((c, k) => {
      const rgb = parseInt(c.slice(1), 16);
      data.set([rgb >> 16, rgb >> 8 & 255, rgb & 255, 255], 4 * k);
    });
    table.needsUpdate = true;
  }

  partShown(part, shown) { this.uniforms.partShown.value[part & 7] = shown ? 1 : 0; }
}

export const partColour = part => "#" + PARTS[part & 7].toString(16).padStart(6, "0");
