#include "apps/study_stability/study_stability.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <stdexcept>

#include "apps/shared/exit_codes.hpp"

#include "apps/shared/print.hpp"
#include "io/files/csv_table.hpp"
#include "io/files/output_directory.hpp"
#include "io/pictures/detail/svg.hpp"

namespace talus {

namespace {

using io::detail::escaped;
using stability::Outcome;
using stability::Scene;
using stability::Verdict;

bool is_stability_name(const std::string& name) {
  return name == "stability.csv" || name == "stability.html";
}

struct Row {
  Scene scene;
  Outcome outcome;
  bool as_expected;
};

std::string expectation(const Scene& scene) {
  std::string text;
  for (Verdict verdict : scene.expected) {
    if (!text.empty()) text += " or ";
    text += name_of(verdict);
  }
  return text;
}

/// Why the verdict is what it is, and what it should have been.
std::string note(const Row& row) {
  std::string text = row.outcome.why.data();
  if (row.as_expected) return text;
  if (!text.empty()) text += "; ";
  return text + "EXPECTED: " + expectation(row.scene);
}

std::vector<Scene> chosen(const std::vector<std::string>& only) {
  std::vector<Scene> all = stability::scenes();
  if (only.empty()) return all;
  for (const std::string& part : only)
    if (std::none_of(all.begin(), all.end(),
                     [&](const Scene& scene) { return scene.name.find(part) != std::string::npos; }))
      throw std::invalid_argument(
          fmt::format("no scene of the study has '{}' in its name; --list prints all names", part));
  std::erase_if(all, [&](const Scene& scene) {
    return std::none_of(only.begin(), only.end(),
                        [&](const std::string& part) { return scene.name.find(part) != std::string::npos; });
  });
  return all;
}

std::string number(double value, const char* none) {
  return value < 0 ? none : fmt::format("{:.1e}", value);
}

std::string judged(const Outcome& outcome) {
  return fmt::format("{}/{}", outcome.judged, outcome.steps);
}

constexpr const char* table_row = "{:<33} {:>8} {:>8} {:>8} {:>8} {:>8} {:>7} {:>6} {:>7} {:>7}  {:<9} {}\n";

std::string table_head() {
  return fmt::format(table_row, "scene", "true", "rms", "balance", "energy", "overlap", "judged", "missed",
                     "sweeps", "seconds", "verdict", "");
}

std::string table_line(const Row& row) {
  const Outcome& o = row.outcome;
  return fmt::format(table_row, row.scene.name, number(o.true_error, "-"), number(o.error_rms, "-"),
                     number(o.balance, "-"), number(o.energy_gained, "-"), number(o.penetration, "-"),
                     judged(o), o.missed, o.iterations, fmt::format("{:.2f}", o.seconds), name_of(o.verdict),
                     note(row));
}

std::string csv(const std::vector<Row>& rows) {
  io::CsvTable table({"scene", "true_error", "error_rms", "balance", "energy_gained", "penetration", "steps",
                      "judged", "missed", "iterations", "seconds", "verdict", "expected", "why", "asks"});
  for (const Row& row : rows) {
    const Outcome& o = row.outcome;
    table.row(row.scene.name, o.true_error < 0 ? "" : fmt::format("{}", o.true_error), o.error_rms, o.balance,
              o.energy_gained, o.penetration, o.steps, o.judged, o.missed, o.iterations, o.seconds,
              name_of(o.verdict), expectation(row.scene), o.why.data(), row.scene.asks);
  }
  return table.text();
}

constexpr const char* page_head = R"(<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>Talus: stability</title>
<style>
body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:80rem;padding:0 1rem;color:#1a1a1a}
table{border-collapse:collapse;font-variant-numeric:tabular-nums}
th,td{padding:.25rem .6rem;border-bottom:1px solid #ddd;text-align:right;vertical-align:top}
th{position:sticky;top:0;background:#fff}
td:first-child,th:first-child,td:last-child,th:last-child{text-align:left}
small{color:#555}
.right,.certified{color:#1a6b2f}.honest{color:#8a5a00}.refused{color:#555}
.wrong,.failed{color:#fff;background:#b00020}
</style></head><body>
<h1>Stability</h1>
)";

constexpr const char* page_legend = R"(<p><b>true</b>: error against the exact answer, of the step where
it is largest against its bound; <b>rms</b>, <b>balance</b>: that step's certificate; <b>energy</b>: largest
gain of a step that no load supplied, over the kinetic energy that it would reach without contacts;
<b>overlap</b>: largest, over the smallest radius; <b>judged</b>: steps that are certified and were compared
with an exact answer, of those made. The <b>bound</b> of a step is twice the largest of rms, balance and
tolerance; where the exact answer is that of a sample at rest, how far the step begins from rest is added.
Without Newton's restitution and correction of overlaps a step may gain twice its bound of energy.</p>
<p><b>right</b>: every step is certified and judged, and within its bounds; <b>certified</b>: every step is
certified, but not all of it is known to be right; <b>honest</b>: missed the tolerance and says so;
<b>refused</b>: an error that names its cause; <b>WRONG</b>: certified, and further from the exact answer than
its bound; <b>FAILED</b>: not a number, a crash, a hang.</p>
<table><thead><tr><th>scene</th><th>true</th><th>rms</th><th>balance</th><th>energy</th><th>overlap</th>
<th>judged</th><th>missed</th><th>sweeps</th><th>s</th><th>verdict</th></tr></thead><tbody>
)";

std::string html(const std::vector<Row>& rows, const std::string& summary) {
  std::string text = page_head + fmt::format("<p>{}</p>\n", escaped(summary)) + page_legend;
  for (const Row& row : rows) {
    const Outcome& o = row.outcome;
    std::string word(name_of(o.verdict)), style = word;
    std::transform(style.begin(), style.end(), style.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    text += fmt::format("<tr><td>{}<br><small>{}</small></td>", row.scene.name, escaped(row.scene.asks));
    for (const std::string& cell :
         {number(o.true_error, ""), number(o.error_rms, ""), number(o.balance, ""),
          number(o.energy_gained, ""), number(o.penetration, ""), judged(o), fmt::format("{}", o.missed),
          fmt::format("{}", o.iterations), fmt::format("{:.2f}", o.seconds)})
      text += "<td>" + cell + "</td>";
    text += fmt::format("<td><span class=\"{}\">{}</span><br><small>{}</small></td></tr>\n", style, word,
                        escaped(note(row)));
  }
  return text + "</tbody></table>\n</body></html>\n";
}

/// `asked`: number of scenes, of which `rows` may be the first ones.
std::string summary_of(const std::vector<Row>& rows, std::size_t asked, double seconds) {
  std::string text = rows.size() == asked ? fmt::format("{} scenes", asked)
                                          : fmt::format("{} of {} scenes", rows.size(), asked);
  text += fmt::format(" in {:.0f} s:", seconds);
  for (Verdict verdict : {Verdict::right, Verdict::certified, Verdict::honest, Verdict::refused,
                          Verdict::wrong, Verdict::failed})
    text += fmt::format(" {} {}{}",
                        std::count_if(rows.begin(), rows.end(),
                                      [&](const Row& row) { return row.outcome.verdict == verdict; }),
                        name_of(verdict), verdict == Verdict::failed ? "" : ",");
  return text;
}

}  // namespace

int stability_command(const StabilityOptions& options) {
  std::vector<Scene> scenes;
  const std::string directory = options.out.empty() ? "out/study-stability" : options.out;
  std::optional<io::DirectoryLock> lock;
  try {
    scenes = chosen(options.only);
    if (options.list) {
      for (const Scene& scene : scenes) print_out("{:<33} {}\n", scene.name, scene.asks);
      return exit_done;
    }
    lock.emplace(io::prepare_output_directory(directory, options.force, is_stability_name, {}));
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_bad_input;
  }
  try {
    const auto start = std::chrono::steady_clock::now();
    std::vector<Row> rows;
    std::string summary;
    print_out("{}", table_head());
    for (const Scene& scene : scenes) {
      std::fflush(nullptr);  // the process of the scene must not print again what waits here
      const Outcome outcome = run_scene_apart(scene, options.settings);
      rows.push_back({scene, outcome, as_expected(scene, outcome, options.settings)});
      print_out("{}", table_line(rows.back()));
      const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      summary = summary_of(rows, scenes.size(), seconds);
      // Behind each scene: they are kept if the next one is stopped.
      io::write_whole(directory + "/stability.csv", csv(rows));
      io::write_whole(directory + "/stability.html", html(rows, summary));
    }
    print_out("\n{}\n", summary);
    print_error("talus: stability.csv and stability.html in {}\n", directory);
    int code = exit_done;
    for (const Row& row : rows)
      if (!row.as_expected) {
        print_error("talus: error: scene '{}' is {}: {}\n", row.scene.name, name_of(row.outcome.verdict),
                    note(row));
        code = exit_failure;
      }
    return code;
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_failure;
  }
}

}  // namespace talus
