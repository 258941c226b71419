// Rows and columns of a cohort in, a table to sort, filter and search out.
"use strict";
(() => {
  const read = (id) => JSON.parse(document.getElementById(id).textContent);
  const rows = read("rows");

  // A filter under a heading: "> 50", "<= 3" or a part of the text.
  function fits(wanted, value) {
    const compared = /^\s*(<=|>=|<|>|=)\s*(-?[\d.]+)\s*$/.exec(wanted);
    if (!compared) return String(value ?? "").toLowerCase().includes(String(wanted).toLowerCase());
    if (typeof value !== "number") return false;
    const number = Number(compared[2]);
    return { "<": value < number, ">": value > number, "<=": value <= number, ">=": value >= number, "=": value === number }[compared[1]];
  }

  function link(cell) {
    const row = cell.getRow().getData();
    if (!row._link) return document.createTextNode(row.subject);
    const a = document.createElement("a");
    a.href = row._link;
    a.textContent = row.subject;
    return a;
  }

  const columns = read("columns").map((column) => ({
    title: column.title,
    field: column.field,
    frozen: column.field === "subject",
    hozAlign: column.number ? "right" : "left",
    sorter: column.number ? "number" : "string",
    sorterParams: { alignEmptyValues: "bottom" },
    headerFilter: "input",
    headerFilterFunc: fits,
    headerTooltip: column.what,
    maxWidth: 420,
    formatter: column.field === "subject" ? link : (cell) => {
      const value = cell.getValue();
      if ((cell.getData()._out || []).includes(column.field)) cell.getElement().classList.add("bad");
      if (value === null || value === undefined) return "";
      const text = document.createElement("span");
      text.textContent = typeof value !== "number" || Number.isInteger(value) ? value : Number(value.toPrecision(3));
      return text;
    },
  }));

  const table = new Tabulator("#subjects", {
    data: rows, columns, index: "subject", height: Math.min(560, 90 + 30 * rows.length), layout: "fitData",
    placeholder: "No subject fits",
  });
  const search = document.getElementById("search");
  const tell = (found) => { document.getElementById("shown").textContent = `${found.length} of ${rows.length} shown`; };
  table.on("dataFiltered", (_, found) => tell(found));
  table.on("tableBuilt", () => tell(rows));
  search.addEventListener("input", () => {
    const wanted = search.value.toLowerCase();
    table.setFilter((row) => ["subject", "status", "reason", "message"].some((key) => String(row[key]).toLowerCase().includes(wanted)));
  });
  const clear = () => { search.value = ""; table.clearFilter(true); };
  document.getElementById("all").addEventListener("click", clear);
  for (const one of document.querySelectorAll("a.only")) {
    one.addEventListener("click", () => { clear(); table.setHeaderFilterValue("reason", one.dataset.reason); });
  }
  window.femprepTable = table;
})();
