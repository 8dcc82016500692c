// Generates a page with three columns: schedule, statement, assembly. Lines of the statement that have indented lines
// below them can be folded. Basic blocks of the assembly are named after the loop that they came from (LLVM writes a
// comment after their labels); the page links loops and blocks by that name.
#include "aot/html.h"

#include <cctype>
#include <sstream>

namespace retrograde::aot {
namespace {

std::string escaped(const std::string& text) {
  std::string result;
  for (char c : text) {
    switch (c) {
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '&':
        result += "&amp;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

size_t indentation(const std::string& line) {
  const size_t first = line.find_first_not_of(' ');
  return first == std::string::npos ? 0 : first;
}

// The loop's variable in "parallel for (y, 0, 10) {"; empty for other lines.
std::string loop_of(const std::string& line) {
  const size_t begin = line.find("for (");
  if (begin == std::string::npos || line.back() != '{') return "";
  const size_t name = begin + 5;
  return line.substr(name, line.find(',', name) - name);
}

class StatementColumn {
 public:
  std::string render(const std::string& statement) {
    lines_ = lines_of(statement);
    for (size_t i = 0; i < lines_.size();) i = render_line(i);
    return out_;
  }

 private:
  std::vector<std::string> lines_;
  std::string out_;

  // Returns the index of the line after the last rendered one.
  size_t render_line(size_t i) {
    const std::string& line = lines_[i];
    const std::string loop = loop_of(line);
    const std::string shown = loop.empty() ? "<span>" + escaped(line) + "</span>"
                                           : "<span class=\"loop\" data-loop=\"" + escaped(loop) +
                                                 "\">" + escaped(line) + "</span>";
    const size_t depth = indentation(line);
    if (i + 1 >= lines_.size() || indentation(lines_[i + 1]) <= depth) {
      out_ += "<div>" + shown + "</div>\n";
      return i + 1;
    }
    out_ += "<details open><summary>" + shown + "</summary>\n";
    for (i++; i < lines_.size() && indentation(lines_[i]) > depth;) i = render_line(i);
    out_ += "</details>\n";
    return i;
  }
};

// The body of a parallel loop is a function named like "f.pipeline.parallel0.f.s0.y".
std::string parallel_loop_of(const std::string& function) {
  const std::string mark = ".parallel";
  const size_t begin = function.find(mark);
  if (begin == std::string::npos) return "";
  const size_t dot = function.find('.', begin + mark.size());
  return dot == std::string::npos ? "" : function.substr(dot + 1);
}

// The loop that a label begins: .LBB0_3:   # %f.s0.x   or   # %"f.s0.x.$1"; empty for other lines.
std::string block_of(const std::string& line) {
  const size_t colon = line.find(':');
  if (colon == std::string::npos) return "";
  if (line[0] != '.') {
    const size_t quote = line[0] == '"' ? 1 : 0;
    return parallel_loop_of(line.substr(quote, colon - 2 * quote));
  }
  const size_t percent = line.find('%');
  if (percent == std::string::npos) return "";
  std::string name = line.substr(percent + 1);
  if (name.size() > 1 && name[0] == '"') name = name.substr(1, name.size() - 2);
  return name;
}

// LLVM appends a number to a block name that is already used: "f.s0.x12" is a copy of "f.s0.x".
std::string without_number(std::string name) {
  while (!name.empty() && std::isdigit(static_cast<unsigned char>(name.back()))) name.pop_back();
  return name;
}

std::string assembly_column(const std::string& assembly) {
  std::string out, block;
  for (const std::string& line : lines_of(assembly)) {
    const bool is_label = !line.empty() && std::isspace(static_cast<unsigned char>(line[0])) == 0;
    if (is_label) block = block_of(line);
    out += "<div";
    if (!block.empty()) {
      out += " data-block=\"" + escaped(block) + "\" data-stem=\"" +
             escaped(without_number(block)) + "\"";
    }
    out += ">" + escaped(line) + "</div>\n";
  }
  return out;
}

const char* const style = R"(<style>
body { margin: 0; font: 13px sans-serif; color: #222; }
h1 { font-size: 15px; margin: 0; padding: 8px 12px; background: #24425c; color: #fff; }
main { display: grid; grid-template-columns: 1fr 2fr 2fr; height: calc(100vh - 34px); }
section { overflow: auto; border-right: 1px solid #ccc; padding: 0 8px; }
h2 { font-size: 13px; position: sticky; top: 0; background: #fff; margin: 0; padding: 6px 0; }
pre, .code { font: 12px/1.45 monospace; white-space: pre; }
details > details, details > div { margin-left: 0; }
summary { cursor: pointer; list-style: none; }
summary::before { content: "\25be"; color: #999; display: inline-block; width: 1em; }
details:not([open]) > summary::before { content: "\25b8"; }
details:not([open]) > summary::after { content: " ..."; color: #999; }
.code > div, details > div { padding-left: 1em; }
.loop { color: #8a2f00; }
.loop:hover { text-decoration: underline; }
.marked { background: #fff0b8; }
</style>
)";

const char* const script = R"(<script>
const linesOf = name => {
  const exact = document.querySelectorAll('[data-block="' + CSS.escape(name) + '"]');
  const stem = document.querySelectorAll('[data-stem="' + CSS.escape(name) + '"]');
  return new Set([...exact, ...stem]);
};
document.querySelectorAll('.loop').forEach(loop => {
  const lines = () => linesOf(loop.dataset.loop);
  loop.addEventListener('mouseenter', () => lines().forEach(l => l.classList.add('marked')));
  loop.addEventListener('mouseleave', () => lines().forEach(l => l.classList.remove('marked')));
  loop.addEventListener('click', event => {
    const first = [...lines()][0];
    if (first) { first.scrollIntoView({block: 'center'}); event.preventDefault(); }
  });
});
</script>
)";

}  // namespace

std::string html_page(const std::string& title, const std::vector<PageFunction>& functions,
                      const std::string& assembly) {
  std::string schedules, statements;
  for (const PageFunction& function : functions) {
    schedules += "<h2>Schedule of " + escaped(function.name) + "</h2>\n<pre>" +
                 escaped(function.schedule) + "</pre>\n";
    statements += "<h2>Statement of " + escaped(function.name) + "</h2>\n<div class=\"code\">\n" +
                  StatementColumn().render(function.statement) + "</div>\n";
  }
  return "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>" +
         escaped(title) + "</title>\n" + style + "</head>\n<body>\n<h1>" + escaped(title) +
         "</h1>\n<main>\n<section id=\"schedule\">\n" + schedules +
         "</section>\n<section id=\"statement\">\n" + statements +
         "</section>\n<section id=\"assembly\">\n<h2>Assembly</h2>\n<div class=\"code\">\n" +
         assembly_column(assembly) + "</div>\n</section>\n</main>\n" + script +
         "</body>\n</html>\n";
}

}  // namespace retrograde::aot
