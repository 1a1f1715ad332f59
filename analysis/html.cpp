#include "analysis/html.hpp"

#include <fmt/format.h>

#include <cmath>

#include "analysis/plot.hpp"

namespace vcnc::html {

const char* const kPageStyle = R"(
:root { --ink: #1d232b; --soft: #5a6270; --line: #dfe3e8; --pass: #1a7f52; --fail: #b3261e; --open: #a15c00; }
* { box-sizing: border-box; }
body { margin: 0; background: #fff; color: var(--ink); font: 15px/1.5 system-ui, "Segoe UI", Helvetica, Arial, sans-serif; }
main { max-width: 980px; margin: 0 auto; padding: 36px 28px 64px; }
h1 { font-size: 26px; font-weight: 650; margin: 0 0 2px; letter-spacing: -0.01em; }
h2 { font-size: 18px; font-weight: 650; margin: 44px 0 10px; padding-top: 14px; border-top: 1px solid var(--line); }
p.lead { color: var(--soft); margin: 0 0 22px; }
.verdict { display: flex; gap: 18px; align-items: center; border: 1px solid var(--line); border-left: 6px solid var(--c); border-radius: 6px; padding: 14px 18px; }
.verdict b { font-size: 22px; color: var(--c); letter-spacing: 0.02em; }
.PASS { --c: var(--pass); } .FAIL { --c: var(--fail); } .INCOMPLETE { --c: var(--open); }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: 12px; margin: 16px 0 0; }
.tile { border: 1px solid var(--line); border-radius: 6px; padding: 10px 14px; }
.tile span { display: block; color: var(--soft); font-size: 13px; }
.tile b { font-size: 20px; font-weight: 620; white-space: nowrap; }
.tile i { display: block; font-style: normal; font-size: 13px; color: var(--soft); }
ul.warnings { border: 1px solid #ecd9b4; background: #fffaf0; border-radius: 6px; padding: 10px 16px 10px 34px; margin: 16px 0 0; }
figure { margin: 0 0 6px; break-inside: avoid; }
figure svg { width: 100%; height: auto; display: block; }
figcaption { color: var(--soft); font-size: 13.5px; margin: 4px 0 0; }
.missing { border: 1px dashed var(--line); border-radius: 6px; padding: 26px; color: var(--soft); text-align: center; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; font-size: 14px; margin: 6px 0; }
th, td { padding: 5px 10px; border-bottom: 1px solid var(--line); text-align: right; }
th { color: var(--soft); font-weight: 600; } th:first-child, td:first-child { text-align: left; }
table.data td { text-align: left; } table.data td:first-child { color: var(--soft); width: 220px; }
code { font-size: 13px; overflow-wrap: anywhere; }
.legend { display: flex; flex-wrap: wrap; gap: 16px; font-size: 13.5px; color: var(--soft); margin-top: 6px; }
.legend i { display: inline-block; width: 12px; height: 12px; border-radius: 2px; margin-right: 6px; vertical-align: -1px; }
@media print { main { max-width: none; padding: 0; } h2 { break-after: avoid; } body { font-size: 12px; } .tile b { font-size: 16px; } }
)";

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
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

std::string um(double metres) {
  return fmt::format("{:.2f}", std::round(metres * 1e8) / 100 + 0.0);
}

std::string figure(const std::string& script, const std::string& caption) {
  std::string why;
  const auto svg = draw_svg(script, why);
  return fmt::format("<figure>{}<figcaption>{}</figcaption></figure>\n",
                     svg ? *svg : fmt::format("<div class=\"missing\">{}</div>", escaped(why)),
                     caption);
}

}  // namespace vcnc::html
