"use strict";
// Figures in a narrow window, on a page or in a file.

const NARROW = 500, LEGEND_LINE = 19, LONGEST_LINE = 30; // pixels, and characters

// Words of a text in lines; a longer word has a line of its own.
function in_lines(text) {
  const lines = [];
  for (const word of text.split(" ")) {
    const longer = `${lines.at(-1)} ${word}`;
    if (lines.length && longer.length <= LONGEST_LINE) lines[lines.length - 1] = longer;
    else lines.push(word);
  }
  return lines.join("<br>");
}
