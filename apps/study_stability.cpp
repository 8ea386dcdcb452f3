#include "apps/study_stability.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "apps/exit_codes.hpp"

#include "io/output_directory.hpp"

namespace talus {

namespace {

using stability::Outcome;
using stability::Scene;
using stability::Verdict;

bool is_stability_name(const std::filesystem::path& relative) {
  const std::string name = relative.string();
  return name == "stability.csv" || name == "stability.html" || name == "stability.csv.part" ||
         name == "stability.html.part";
}

struct Row {
  Scene scene;
  Outcome outcome;
};

bool bad(Verdict verdict) {
  return verdict == Verdict::wrong || verdict == Verdict::failed;
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

constexpr const char* table_row = "{:<33} {:>9} {:>8} {:>8} {:>8} {:>8} {:>5} {:>6} {:>7} {:>7}  {:<9} {}\n";

std::string table_head() {
  return fmt::format(table_row, "scene", "true", "rms", "balance", "energy", "overlap", "steps", "missed",
                     "sweeps", "seconds", "verdict", "");
}

std::string table_line(const Row& row) {
  const Outcome& o = row.outcome;
  return fmt::format(table_row, row.scene.name, number(o.true_error, "-"), number(o.error_rms, "-"),
                     number(o.balance, "-"), number(o.energy_gained, "-"), number(o.penetration, "-"),
                     o.steps, o.missed, o.iterations, fmt::format("{:.2f}", o.seconds), name_of(o.verdict),
                     o.why.data());
}

std::string quoted(std::string text) {
  for (std::size_t at = 0; (at = text.find('"', at)) != std::string::npos; at += 2) text.insert(at, 1, '"');
  return '"' + text + '"';
}

std::string csv(const std::vector<Row>& rows) {
  std::string text =
      "scene,true_error,error_rms,balance,energy_gained,penetration,steps,missed,iterations,seconds,verdict,"
      "why,asks\n";
  for (const Row& row : rows) {
    const Outcome& o = row.outcome;
    text += fmt::format("{},{},{},{},{},{},{},{},{},{:.3f},{},{},{}\n", row.scene.name,
                        o.true_error < 0 ? "" : fmt::format("{}", o.true_error), o.error_rms, o.balance,
                        o.energy_gained, o.penetration, o.steps, o.missed, o.iterations, o.seconds,
                        name_of(o.verdict), quoted(o.why.data()), quoted(row.scene.asks));
  }
  return text;
}

std::string escaped(const std::string& text) {
  std::string out;
  for (char c : text) {
    if (c == '<')
      out += "&lt;";
    else if (c == '&')
      out += "&amp;";
    else
      out += c;
  }
  return out;
}

std::string html(const std::vector<Row>& rows, const std::string& summary) {
  std::string text = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Talus: "
      "stability</title>\n<style>\n"
      "body{{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:80rem;padding:0 "
      "1rem;color:#1a1a1a}}\n"
      "table{{border-collapse:collapse;font-variant-numeric:tabular-nums}}\n"
      "th,td{{padding:.25rem .6rem;border-bottom:1px solid #ddd;text-align:right;vertical-align:top}}\n"
      "th{{position:sticky;top:0;background:#fff}}\n"
      "td:first-child,th:first-child,td:last-child,th:last-child{{text-align:left}}\n"
      "small{{color:#555}}\n"
      ".right,.certified{{color:#1a6b2f}}.honest{{color:#8a5a00}}.refused{{color:#555}}"
      ".wrong,.failed{{color:#fff;background:#b00020}}\n"
      "</style></head><body>\n<h1>Stability</h1>\n<p>{}</p>\n"
      "<p><b>true</b>: error against the exact answer, of the step where it is largest against the "
      "certificate; "
      "<b>rms</b>, <b>balance</b>: that step's certificate; <b>energy</b>: largest gain that no load "
      "supplied, "
      "over the largest kinetic energy of a step without contacts; <b>overlap</b>: largest, over the "
      "smallest "
      "radius. <b>right</b>: certified, and the true error is at most twice the certificate; "
      "<b>certified</b>: "
      "the truth is not known; <b>honest</b>: missed the tolerance and says so; <b>refused</b>: an error "
      "that "
      "names its cause; <b>WRONG</b>: certified, and it is not so; <b>FAILED</b>: not a number, a crash, a "
      "hang.</p>\n<table><thead><tr><th>scene</th><th>true</th><th>rms</th><th>balance</th><th>energy</th>"
      "<th>overlap</th><th>steps</th><th>missed</th><th>sweeps</th><th>s</th><th>verdict</th></tr></thead>"
      "<tbody>\n",
      escaped(summary));
  for (const Row& row : rows) {
    const Outcome& o = row.outcome;
    std::string word(name_of(o.verdict)), style = word;
    std::transform(style.begin(), style.end(), style.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    text += fmt::format(
        "<tr><td>{}<br><small>{}</small></td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</"
        "td>"
        "<td>{}</td><td>{}</td><td>{:.2f}</td><td><span "
        "class=\"{}\">{}</span><br><small>{}</small></td></tr>\n",
        row.scene.name, escaped(row.scene.asks), number(o.true_error, ""), number(o.error_rms, ""),
        number(o.balance, ""), number(o.energy_gained, ""), number(o.penetration, ""), o.steps, o.missed,
        o.iterations, o.seconds, style, word, escaped(o.why.data()));
  }
  return text + "</tbody></table>\n</body></html>\n";
}

std::string summary_of(const std::vector<Row>& rows, double seconds) {
  std::string text = fmt::format("{} scenes in {:.0f} s:", rows.size(), seconds);
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
  try {
    scenes = chosen(options.only);
    if (options.list) {
      for (const Scene& scene : scenes) fmt::print("{:<33} {}\n", scene.name, scene.asks);
      return exit_done;
    }
    io::prepare_output_directory(directory, options.force, is_stability_name);
  } catch (const std::exception& error) {
    fmt::print(stderr, "talus: error: {}\n", error.what());
    return exit_bad_input;
  }
  try {
    const auto start = std::chrono::steady_clock::now();
    std::vector<Row> rows;
    fmt::print("{}", table_head());
    for (const Scene& scene : scenes) {
      std::fflush(nullptr);  // the process of the scene must not print again what waits here
      rows.push_back({scene, run_scene_apart(scene, options.settings)});
      fmt::print("{}", table_line(rows.back()));
    }
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const std::string summary = summary_of(rows, seconds);
    fmt::print("\n{}\n", summary);
    io::write_whole(directory + "/stability.csv", csv(rows));
    io::write_whole(directory + "/stability.html", html(rows, summary));
    fmt::print(stderr, "talus: stability.csv and stability.html in {}\n", directory);
    const bool sound =
        std::none_of(rows.begin(), rows.end(), [](const Row& row) { return bad(row.outcome.verdict); });
    return sound ? exit_done : exit_failure;
  } catch (const std::exception& error) {
    fmt::print(stderr, "talus: error: {}\n", error.what());
    return exit_failure;
  }
}

}  // namespace talus
