// Runs once in a page, and again for each session of it, with the input's id in its own field's id.
(() => {
  window.mocapdbInput = "@INPUT@";
  window.mocapdbSize = ""; // what this session was told of it
  window.mocapdbSent = []; // [number, message] of the last half second
  if (window.mocapdbSend) return;
  const KEPT_MS = 500; // viser sends a field every 50 ms at most, and only its last value
  let count = 0;
  const send = (text) => {
    // viser's text field takes what a script has typed if React's own setter is passed by
    let place = document.querySelector(`label[for="${window.mocapdbInput}"]`);
    while (place && !place.querySelector("input")) place = place.parentElement;
    if (!place) return false;
    const input = place.querySelector("input");
    Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set.call(input, numbered(text));
    input.dispatchEvent(new Event("input", { bubbles: true }));
    return true;
  };
  // The message behind those that may not have been sent yet: each has its number, so none counts twice.
  const times = new Map();
  const numbered = (text) => {
    const now = performance.now();
    times.set(++count, now);
    window.mocapdbSent = window.mocapdbSent.filter(([number]) => now - times.get(number) < KEPT_MS);
    window.mocapdbSent.push([count, text]);
    for (const number of times.keys()) if (number < window.mocapdbSent[0][0]) times.delete(number);
    return JSON.stringify(window.mocapdbSent);
  };
  window.mocapdbSend = send;
  document.addEventListener("click", (event) => {
    const target = event.target.closest("[data-send]");
    if (target) send(target.dataset.send);
  });
  document.addEventListener("change", (event) => {
    const target = event.target.closest("[data-choose]");
    if (!target) return;
    send(`${target.dataset.choose} ${target.value}`);
    if (target.dataset.choose === "column") target.selectedIndex = 0; // it stays a menu
  });
  document.addEventListener("input", (event) => {
    const verb = event.target.dataset?.type;
    if (verb) send(`${verb} ${event.target.value}`);
  });
  document.addEventListener("keydown", (event) => {
    if (/^(INPUT|TEXTAREA|SELECT|BUTTON)$/.test(event.target.tagName)) return;
    const key = { " ": "toggle", ArrowLeft: "step -1", ArrowRight: "step 1",
      ArrowUp: "next -1", ArrowDown: "next 1" }[event.key];
    if (!key) return;
    event.preventDefault();
    send(key);
  });
  // Dragging: along a track to scrub, along a strip or a histogram to select.
  let drag = null;
  const value = (event) => {
    const box = drag.getBoundingClientRect();
    const share = Math.max(0, Math.min(1, (event.clientX - box.left) / box.width));
    const low = Number(drag.dataset.low), high = Number(drag.dataset.high);
    return low + share * (high - low);
  };
  let from = 0, last = 0;
  document.addEventListener("pointerdown", (event) => {
    const target = event.target.closest("[data-send], [data-drag]");
    if (!target?.dataset.drag) return;
    drag = target;
    event.preventDefault();
    from = value(event);
    if (drag.dataset.drag === "seek") send(`seek ${from}`);
  });
  document.addEventListener("pointermove", (event) => {
    if (!drag?.isConnected) drag = null; // the panel was written anew
    if (!drag) return;
    const now = value(event);
    if (drag.dataset.drag === "range") {
      const mark = drag.querySelector(".mt-chosen"), low = Number(drag.dataset.low);
      const all = Number(drag.dataset.high) - low;
      mark.style.left = `${(100 * (Math.min(from, now) - low)) / all}%`;
      mark.style.width = `${(100 * Math.abs(now - from)) / all}%`;
    } else if (performance.now() - last > 30) {
      last = performance.now();
      send(`seek ${now}`);
    }
  });
  document.addEventListener("pointerup", (event) => {
    if (!drag?.isConnected) drag = null;
    if (!drag) return;
    const now = value(event);
    if (drag.dataset.drag === "range") send(`${drag.dataset.verb} ${Math.min(from, now)} ${Math.max(from, now)}`);
    else send(`seek ${now}`);
    drag = null;
  });
  // Pictures play while the mouse is over them, or over the row or card that they stand in.
  const play = (event, plays) => {
    const place = event.target.closest?.("tr, .mt-card");
    if (!place || place.contains(event.relatedTarget)) return;
    for (const image of place.querySelectorAll("img[data-loop]")) {
      image.dataset.still ??= image.getAttribute("src");
      image.setAttribute("src", plays ? image.dataset.loop : image.dataset.still);
    }
  };
  document.addEventListener("mouseover", (event) => play(event, true));
  document.addEventListener("mouseout", (event) => play(event, false));
  // On a busy machine a picture may not come in time: nothing is shown, and it is asked for again.
  document.addEventListener("error", ({ target: image }) => {
    if (!image.classList?.contains("mt-picture")) return;
    image.style.opacity = 0;
    const address = image.getAttribute("src"), tries = Number(image.dataset.tries ?? 0);
    image.dataset.tries = tries + 1;
    if (tries < 6)
      setTimeout(() => {
        if (image.getAttribute("src") === address) image.setAttribute("src", address);
      }, 500 * 2 ** tries);
  }, true);
  document.addEventListener("load", ({ target: image }) => {
    if (!image.classList?.contains("mt-picture")) return;
    image.style.opacity = "";
    image.dataset.tries = 0;
  }, true);
  // What is written anew under the same name is scrolled to where it was.
  const scrolled = new Map();
  document.addEventListener("scroll", (event) => {
    const name = event.target.dataset?.scroll;
    if (name) scrolled.set(name, event.target.scrollTop);
  }, true);
  new MutationObserver((changes) => {
    for (const { addedNodes } of changes)
      for (const node of addedNodes)
        for (const place of node.querySelectorAll?.("[data-scroll]") ?? [])
          place.scrollTop = scrolled.get(place.dataset.scroll) ?? 0;
  }).observe(document.body, { childList: true, subtree: true });
  setInterval(() => {
    const stage = document.querySelector("canvas");
    const size = stage && `${stage.clientWidth} ${stage.clientHeight} ${innerWidth}`;
    if (size && size !== window.mocapdbSize && send(`stage ${size}`)) window.mocapdbSize = size;
  }, 300);
  window.mocapdbShow = (id) => document.getElementById(id)?.scrollIntoView({ block: "nearest" });
})();
