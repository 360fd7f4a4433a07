"use strict";
// Plays stages on canvases. A stage is an element <div class="stage" data-stage="ID">, its data the
// JSON in <script type="application/json" id="ID">. Nothing is asked for from outside.
(() => {
  const VIEW_ANGLE = (32 * Math.PI) / 180;
  const NEAR = 0.1;
  const SPEEDS = [0.1, 0.25, 0.5, 1, 2];

  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const rgb = (hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));
  const css = (c) => `rgb(${c[0] | 0},${c[1] | 0},${c[2] | 0})`;
  const mix = (a, b, t) => a.map((v, i) => v + (b[i] - v) * t);

  class Actor {
    constructor(data) {
      Object.assign(this, data);
      const raw = new Int16Array(bytes(data.positions).buffer);
      this.points = new Float32Array(raw.length);
      for (let i = 0; i < raw.length; i++)
        this.points[i] = raw[i] * data.scale + data.centre[i % 3];
      this.error = data.error ? bytes(data.error) : null;
      this.base = rgb(data.colour);
    }

    // Coordinates of a joint between two frames, into `out`.
    at(time, joint, out) {
      const last = this.frames - 1;
      const here = Math.min(Math.floor(time), last);
      const there = Math.min(here + 1, last);
      const share = Math.min(time - here, 1);
      const a = 3 * (here * this.joints + joint), b = 3 * (there * this.joints + joint);
      for (let i = 0; i < 3; i++)
        out[i] = this.points[a + i] + (this.points[b + i] - this.points[a + i]) * share;
    }

    colourOf(time, bone, colours) {
      if (this.error) {
        const frame = Math.min(Math.floor(time), this.frames - 1);
        const share = (this.error[frame * this.tails.length + bone] / 255) * (colours.length - 1);
        const i = Math.min(Math.floor(share), colours.length - 2);
        return mix(colours[i], colours[i + 1], share - i);
      }
      const side = this.sides[bone];
      return side > 0 ? mix(this.base, [255, 255, 255], 0.38) : side < 0 ? mix(this.base, [0, 0, 0], 0.3) : this.base;
    }
  }

  class Player {
    constructor(element, data) {
      this.element = element;
      this.data = data;
      this.actors = data.actors.map((actor) => new Actor(actor));
      this.frames = Math.max(...data.actors.map((actor) => actor.frames));
      this.targets = new Float32Array(bytes(data.targets).buffer);
      this.time = 0;
      this.speed = 1;
      this.playing = data.autoplay && !matchMedia("(prefers-reduced-motion: reduce)").matches;
      this.visible = true;
      this.home();
      this.build();
      this.listen();
      this.dirty = true;
      let before = performance.now();
      const tick = (now) => {
        const seconds = Math.min((now - before) / 1000, 0.1);
        before = now;
        if (this.playing && this.visible) {
          this.time += seconds * this.speed * this.data.fps;
          if (this.time > this.frames - 1)
            this.time = this.data.loop ? this.time % Math.max(this.frames - 1, 1) : this.frames - 1;
          this.dirty = true;
        }
        if (this.dirty && this.visible) this.draw();
        requestAnimationFrame(tick);
      };
      requestAnimationFrame(tick);
    }

    home() {
      this.yaw = this.data.yaw;
      this.pitch = this.data.pitch;
      this.zoom = 1;
    }

    build() {
      this.canvas = document.createElement("canvas");
      this.canvas.tabIndex = 0;
      this.canvas.setAttribute("role", "img");
      this.canvas.setAttribute("aria-label", this.data.title || "a motion");
      this.pen = this.canvas.getContext("2d");
      const bar = document.createElement("div");
      bar.className = "stage-bar";
      this.button = document.createElement("button");
      this.scrub = Object.assign(document.createElement("input"), {
        type: "range", min: 0, max: Math.max(this.frames - 1, 1), step: "any", value: 0,
      });
      this.scrub.setAttribute("aria-label", "time");
      this.clock = document.createElement("output");
      this.pace = document.createElement("select");
      this.pace.setAttribute("aria-label", "speed");
      for (const speed of SPEEDS)
        this.pace.add(new Option(`${speed}\u00d7`, speed, speed === 1, speed === 1));
      bar.append(this.button, this.scrub, this.clock, this.pace);
      const key = document.createElement("div");
      key.className = "stage-key";
      this.data.legend.forEach((text, i) => {
        const actor = this.actors[i];
        const item = document.createElement("span");
        const dot = document.createElement("i");
        dot.style.background = actor.error
          ? `linear-gradient(90deg,${this.data.colours.map(css).join(",")})` : actor.colour;
        if (actor.error) dot.className = "ramp";
        item.append(dot, text);
        key.append(item);
      });
      this.element.append(this.canvas, key, bar);
      this.label();
    }

    label() {
      this.button.textContent = this.playing ? "\u275a\u275a" : "\u25b6";
      this.button.setAttribute("aria-label", this.playing ? "pause" : "play");
    }

    toggle() {
      this.playing = !this.playing;
      if (this.playing && this.time >= this.frames - 1) this.time = 0;
      this.label();
    }

    listen() {
      this.button.onclick = () => this.toggle();
      this.scrub.oninput = () => {
        this.time = Number(this.scrub.value);
        this.dirty = true;
      };
      this.pace.onchange = () => (this.speed = Number(this.pace.value));
      this.canvas.onkeydown = (event) => {
        const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
        if (event.key === " ") this.toggle();
        else if (step) {
          this.playing = false;
          this.label();
          this.time = Math.max(0, Math.min(this.frames - 1, Math.round(this.time) + step));
        } else return;
        this.dirty = true;
        event.preventDefault();
      };
      this.canvas.onpointerdown = (event) => this.canvas.setPointerCapture(event.pointerId);
      this.canvas.onpointermove = (event) => {
        if (!event.buttons) return;
        this.yaw -= event.movementX * 0.008;
        this.pitch = Math.max(-0.1, Math.min(1.5, this.pitch + event.movementY * 0.006));
        this.dirty = true;
      };
      this.canvas.ondblclick = () => {
        this.home();
        this.dirty = true;
      };
      this.canvas.addEventListener("wheel", (event) => {
        if (!event.ctrlKey && document.activeElement !== this.canvas) return; // the page scrolls
        event.preventDefault();
        this.zoom = Math.max(0.3, Math.min(4, this.zoom * Math.exp(event.deltaY * 0.001)));
        this.dirty = true;
      }, { passive: false });
      new ResizeObserver(() => (this.dirty = true)).observe(this.canvas);
      new IntersectionObserver((seen) => {
        this.visible = seen[seen.length - 1].isIntersecting;
        this.dirty = true;
      }).observe(this.canvas);
    }

    // ---- drawing: a painter's algorithm over capsules ------------------------------------------

    look() {
      const frame = Math.min(Math.floor(this.time), this.frames - 1);
      const next = Math.min(frame + 1, this.frames - 1), share = this.time - frame;
      this.target = [0, 1, 2].map((i) =>
        this.targets[3 * frame + i] * (1 - share) + this.targets[3 * next + i] * share);
      const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
      this.right = [cy, 0, -sy];
      this.back = [sy * cp, sp, cy * cp];
      this.up = [-sy * sp, cp, -cy * sp];
      this.eye = this.target.map((v, i) => v + this.back[i] * this.data.distance * this.zoom);
      this.focal = Math.min(this.height, 1.2 * this.width) / 2 / Math.tan(VIEW_ANGLE / 2);
    }

    // Screen x, y and depth of a point.
    project(p) {
      const d = [p[0] - this.eye[0], p[1] - this.eye[1], p[2] - this.eye[2]];
      const dot = (a) => d[0] * a[0] + d[1] * a[1] + d[2] * a[2];
      const depth = Math.max(-dot(this.back), NEAR);
      const scale = this.focal / depth;
      return [this.width / 2 + dot(this.right) * scale, this.height / 2 - dot(this.up) * scale, depth, scale];
    }

    draw() {
      this.dirty = false;
      const ratio = Math.min(devicePixelRatio || 1, 2);
      const { clientWidth: width, clientHeight: height } = this.canvas;
      if (!width || !height) return;
      if (this.canvas.width !== Math.round(width * ratio) || this.canvas.height !== Math.round(height * ratio)) {
        this.canvas.width = Math.round(width * ratio);
        this.canvas.height = Math.round(height * ratio);
      }
      [this.width, this.height] = [width, height];
      this.pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      this.look();
      const sky = this.pen.createLinearGradient(0, 0, 0, height);
      sky.addColorStop(0, "#eef2f5");
      sky.addColorStop(1, "#dfe5ea");
      this.pen.fillStyle = sky;
      this.pen.fillRect(0, 0, width, height);
      this.ground();
      this.bodies();
      this.scrub.value = this.time;
      this.clock.textContent = `${(this.time / this.data.fps).toFixed(2)} / ${((this.frames - 1) / this.data.fps).toFixed(2)} s`;
      this.element.dataset.frame = this.time.toFixed(2);
    }

    ground() {
      const step = 2 ** Math.max(0, Math.ceil(Math.log2(this.data.distance / 10)));
      const reach = Math.max(3, Math.ceil((this.data.distance * 1.1) / step));
      const x0 = step * Math.round(this.target[0] / step), z0 = step * Math.round(this.target[2] / step);
      this.pen.lineWidth = 1;
      const depth = (p) => -(p[0] - this.eye[0]) * this.back[0] - (p[1] - this.eye[1]) * this.back[1] - (p[2] - this.eye[2]) * this.back[2];
      const line = (a, b, far) => {
        if (depth(a) < NEAR || depth(b) < NEAR) return;
        const p = this.project(a), q = this.project(b);
        this.pen.strokeStyle = `rgba(110,125,140,${Math.max(0, 0.4 * (1 - far))})`;
        this.pen.beginPath();
        this.pen.moveTo(p[0], p[1]);
        this.pen.lineTo(q[0], q[1]);
        this.pen.stroke();
      };
      for (let i = -reach; i <= reach; i++)
        for (let j = -reach; j < reach; j++) {
          const far = Math.hypot(i, j + 0.5) / reach;
          if (far > 1) continue;
          const [p, q] = [step * i, step * j];
          line([x0 + p, 0, z0 + q], [x0 + p, 0, z0 + q + step], far);
          line([x0 + q, 0, z0 + p], [x0 + q + step, 0, z0 + p], far);
        }
    }

    bodies() {
      const capsules = [], a = [0, 0, 0], b = [0, 0, 0];
      this.pen.lineCap = "round";
      this.pen.strokeStyle = "#c9d1d8";
      for (const actor of this.actors)
        for (let bone = 0; bone < actor.tails.length; bone++) {
          actor.at(this.time, actor.tails[bone], a);
          actor.at(this.time, actor.heads[bone], b);
          this.pen.lineWidth = 2 * actor.radii[bone] * this.stroke([a[0], 0, a[2]], [b[0], 0, b[2]]);
          this.pen.stroke();
          const p = this.project(a), q = this.project(b);
          const shade = Math.abs((b[1] - a[1]) / (Math.hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]) || 1));
          capsules.push({
            p, q, depth: p[2] + q[2], width: actor.radii[bone] * (p[3] + q[3]),
            colour: mix(actor.colourOf(this.time, bone, this.data.colours), [0, 0, 0], 0.16 * (1 - shade)),
          });
        }
      capsules.sort((x, y) => y.depth - x.depth);
      for (const { p, q, width, colour } of capsules) {
        const layer = (offset, size, style) => {
          this.pen.beginPath();
          this.pen.moveTo(p[0] + offset, p[1] + offset);
          this.pen.lineTo(q[0] + offset + 0.01, q[1] + offset);
          this.pen.lineWidth = size;
          this.pen.strokeStyle = style;
          this.pen.stroke();
        };
        layer(0, width + 1.6, css(mix(colour, [0, 0, 0], 0.55)));
        layer(0, width, css(colour));
        layer(-width * 0.14, width * 0.42, css(mix(colour, [255, 255, 255], 0.22)));
      }
    }

    // Lay a path between two points and return its scale.
    stroke(a, b) {
      const p = this.project(a), q = this.project(b);
      this.pen.beginPath();
      this.pen.moveTo(p[0], p[1]);
      this.pen.lineTo(q[0] + 0.01, q[1]);
      return 0.5 * (p[3] + q[3]);
    }
  }

  window.mocapdbPlayers = [...document.querySelectorAll(".stage[data-stage]")].map(
    (element) => new Player(element, JSON.parse(document.getElementById(element.dataset.stage).textContent)));
})();
