"use strict";
// Tables sort by the column whose head is clicked, numbers by value; again, the other way round.
for (const table of document.querySelectorAll("table.sorts")) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    head.firstElementChild.onclick = () => {
      const down = head.getAttribute("aria-sort") === "ascending";
      for (const other of heads) other.setAttribute("aria-sort", "none");
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const key = (row) => row.cells[column].dataset.value ?? row.cells[column].textContent;
      const number = table.tBodies[0].rows[0]?.cells[column].dataset.value !== undefined;
      const rows = [...table.tBodies[0].rows].sort((a, b) =>
        number ? key(a) - key(b) : key(a).localeCompare(key(b), undefined, { numeric: true }));
      table.tBodies[0].append(...(down ? rows.reverse() : rows));
    };
  });
}
