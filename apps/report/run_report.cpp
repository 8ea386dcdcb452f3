#include "apps/report/run_report.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "apps/report/sections.hpp"
#include "apps/shared/exit_codes.hpp"
#include "apps/shared/print.hpp"
#include "apps/shared/run_json_files.hpp"
#include "io/files/output_directory.hpp"

namespace talus {

namespace {

using Kind = io::HtmlNotice::Kind;

/// What came of the run, in a sentence.
io::HtmlNotice notice_of(const RunFolder& run) {
  const auto& converged = run.steps["converged"];
  const auto missed = std::count(converged.begin(), converged.end(), 0.0);
  const std::string certificate = certificate_sentence(converged.size(), static_cast<std::size_t>(missed));
  const std::string status = run.summary.value("status", "running");
  const std::string message = run.summary.value("message", "");
  const std::string said = message.empty() ? "" : " (" + message + ")";
  if (status == "failed") {
    const auto told = run.summary.value("steps", std::int64_t{0});
    const std::string lacking =
        told > std::ssize(converged)
            ? fmt::format(" steps.csv has {} of its {} steps.", converged.size(), told)
            : "";
    return {Kind::bad, "The run failed" + said + ". " + certificate + lacking};
  }
  const Kind kind = missed > 0 ? Kind::warning : Kind::good;
  if (status == "stopped")
    return {Kind::warning, "The run was stopped" + said + "; --resume goes on. " + certificate};
  if (status == "done") return {kind, "The run is done" + said + ". " + certificate};
  std::string where;
  if (run.status.contains("stage"))
    where = fmt::format(" Stage '{}', {:.0f} % done.", run.status.value("stage", ""),
                        100 * run.status.value("stage_fraction", 0.0));
  return {Kind::warning,
          "The run goes on, or was killed: `talus status` tells." + where + " So far: " + certificate};
}

std::string page_of(const RunFolder& run) {
  HtmlSections sections;
  for (const auto section : {scene_section, view_section, certificate_section, experiment_sections,
                             picture_section, time_section, left_out_section, repeat_section})
    for (io::HtmlSection& part : section(run)) sections.push_back(std::move(part));
  const std::string name = run.scene ? run.scene->name : run.directory.filename().string();
  return io::html_page(name, run.scene ? run.scene->description : "", sections, notice_of(run));
}

}  // namespace

std::string run_report(const std::filesystem::path& directory) {
  return page_of(read_run_folder(directory));
}

int report_command(const ReportOptions& options) {
  std::string page;
  const std::filesystem::path out = options.out.empty()
                                        ? std::filesystem::path(options.directory) / "report.html"
                                        : std::filesystem::path(options.out);
  try {
    const RunFolder run = read_run_folder(options.directory);
    io::check_output_files(sources_in(options.directory), {out}, options.out.empty() || options.force);
    page = page_of(run);
  } catch (const nlohmann::json::exception& error) {
    print_error("talus: error: {}\n", damaged_value(options.directory, error));
    return exit_bad_input;
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_bad_input;
  }
  try {
    io::write_whole(out, page);
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_failure;
  }
  print_error("talus: {} written\n", out.string());
  return exit_done;
}

}  // namespace talus
