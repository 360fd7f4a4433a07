// Runs once in a page, and again for each session of it, with the input's id in its own field's id.
(() => {
  window.mocapdbInput = "@INPUT@";
  if (window.mocapdbSend) return;
  let count = 0;
  const send = (text) => {
    // viser's text field takes what a script has typed if React's own setter is passed by
    let place = document.querySelector(`label[for="${window.mocapdbInput}"]`);
    while (place && !place.querySelector("input")) place = place.parentElement;
    if (!place) return;
    const input = place.querySelector("input");
    Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set.call(input, `${++count} ${text}`);
    input.dispatchEvent(new Event("input", { bubbles: true }));
  };
  window.mocapdbSend = send;
  document.addEventListener("click", (event) => {
    const target = event.target.closest("[data-send]");
    if (target) send(target.dataset.send);
  });
  document.addEventListener("change", (event) => {
    const target = event.target.closest("[data-choose]");
    if (target) send(`${target.dataset.choose} ${target.value}`);
  });
  document.addEventListener("keydown", (event) => {
    if (/^(INPUT|TEXTAREA|SELECT|BUTTON)$/.test(event.target.tagName)) return;
    const key = { " ": "toggle", ArrowLeft: "step -1", ArrowRight: "step 1" }[event.key];
    if (!key) return;
    event.preventDefault();
    send(key);
  });
  // Dragging: along a track to scrub, along a strip to select.
  let drag = null;
  const seconds = (event) => {
    const box = drag.getBoundingClientRect();
    const share = Math.max(0, Math.min(1, (event.clientX - box.left) / box.width));
    return share * Number(drag.dataset.seconds);
  };
  let from = 0, last = 0;
  document.addEventListener("pointerdown", (event) => {
    if (event.target.closest("[data-send]")) return;
    drag = event.target.closest("[data-drag]");
    if (!drag) return;
    event.preventDefault();
    from = seconds(event);
    if (drag.dataset.drag === "seek") send(`seek ${from}`);
  });
  document.addEventListener("pointermove", (event) => {
    if (!drag?.isConnected) drag = null; // the panel was written anew
    if (!drag) return;
    const now = seconds(event);
    if (drag.dataset.drag === "range") {
      const mark = drag.querySelector(".mt-chosen"), all = Number(drag.dataset.seconds);
      mark.style.left = `${(100 * Math.min(from, now)) / all}%`;
      mark.style.width = `${(100 * Math.abs(now - from)) / all}%`;
    } else if (performance.now() - last > 30) {
      last = performance.now();
      send(`seek ${now}`);
    }
  });
  document.addEventListener("pointerup", (event) => {
    if (!drag?.isConnected) drag = null;
    if (!drag) return;
    const now = seconds(event);
    if (drag.dataset.drag === "range") send(`range ${Math.min(from, now)} ${Math.max(from, now)}`);
    else send(`seek ${now}`);
    drag = null;
  });
})();
