#include "apps/validate/validate.hpp"

#include <fmt/format.h>

#include <chrono>
#include <exception>
#include <optional>

#include "apps/shared/exit_codes.hpp"
#include "apps/shared/print.hpp"
#include "apps/shared/report_page.hpp"
#include "io/files/csv_table.hpp"
#include "io/files/output_directory.hpp"

namespace talus {

namespace {

using literature::Case;
using literature::CaseResult;
using literature::Measure;

struct Judged {
  std::string name, sentence;
  CaseResult result;
  double seconds = 0;
};

constexpr std::string_view tables[] = {"validation.csv"};
constexpr std::string_view charts[] = {"packing", "critical-ratio", "critical-fraction", "rheology",
                                       "forces"};

bool is_validation_name(const std::string& name) {
  return is_report_name(name, tables, charts);
}

std::vector<Case> chosen(const std::vector<std::string>& only) {
  if (only.empty()) return {literature::cases().begin(), literature::cases().end()};
  std::vector<Case> some;
  for (const std::string& name : only) some.push_back(literature::cases().named(name));
  return some;
}

const char* verdict_of(const Measure& measure) {
  if (!measure.judged()) return "";
  return measure.holds() ? "holds" : "DOES NOT";
}

std::string value_of(const Measure& measure) {
  return measure.scatter > 0 ? fmt::format("{:.4g} ± {:.1g}", measure.value, measure.scatter)
                             : fmt::format("{:.4g}", measure.value);
}

std::string band_of(const Measure& measure) {
  return measure.judged() ? fmt::format("{:g} to {:g}", measure.low, measure.high) : "";
}

std::string csv(const std::vector<Judged>& all) {
  io::CsvTable table({"case", "quantity", "value", "scatter", "low", "high", "verdict", "source", "steps",
                      "missed", "seconds"});
  for (const Judged& one : all)
    for (const Measure& m : one.result.measures)
      table.row(one.name, m.quantity, m.value, m.scatter, m.judged() ? fmt::format("{}", m.low) : "",
                m.judged() ? fmt::format("{}", m.high) : "", verdict_of(m), m.source, one.result.steps,
                one.result.missed, one.seconds);
  return table.text();
}

void print_case(const Judged& one) {
  print_out("{}: {} ({:.1f} s, {} steps, {} missed)\n", one.name, one.sentence, one.seconds, one.result.steps,
            one.result.missed);
  for (const Measure& m : one.result.measures)
    print_out("  {:<60} {:>18}  {:<18} {:<9} {}\n", m.quantity, value_of(m), band_of(m), verdict_of(m),
              m.source);
}

io::HtmlTable table_of(const Judged& one) {
  io::HtmlTable table;
  table.columns = {"quantity", "value", "band", "", "source of the band"};
  for (const Measure& m : one.result.measures)
    table.rows.push_back({m.quantity, value_of(m), band_of(m), verdict_of(m), m.source});
  return table;
}

/// `asked`: number of cases, of which `all` may be the first ones.
ReportPage page_of(const std::vector<Judged>& all, std::size_t asked, int failed, double seconds) {
  ReportPage page;
  page.title = "Talus beside the literature";
  const std::string cases =
      all.size() == asked ? fmt::format("{}", asked) : fmt::format("{} of {}", all.size(), asked);
  page.introduction = fmt::format(
      "{} cases in {:.0f} s; {} numbers out of their bands. {} Scatter is the standard error over seeds; a "
      "number without a band is information.",
      cases, seconds, failed, where_and_when());
  page.tables.emplace_back("validation.csv", csv(all));
  for (const Judged& one : all) {
    const std::string text = fmt::format("{}. {:.1f} s, {} steps, {} over their tolerance.", one.sentence,
                                         one.seconds, one.result.steps, one.result.missed);
    page.sections.push_back({one.name, text, "", table_of(one)});
    for (const io::Chart& chart : one.result.charts) add_chart(page, chart, "");
  }
  return page;
}

}  // namespace

int validate_command(const ValidateOptions& options) {
  std::vector<Case> some;
  const std::string directory = options.out.empty() ? "out/validate" : options.out;
  std::optional<io::DirectoryLock> lock;
  try {
    some = chosen(options.only);
    if (options.list) {
      for (const Case& one : some) print_out("{:<16} {}\n", one.name, one.sentence);
      return exit_done;
    }
    lock.emplace(io::prepare_output_directory(directory, options.force, is_validation_name, {}));
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_bad_input;
  }
  try {
    using Clock = std::chrono::steady_clock;
    const auto since = [](Clock::time_point start) {
      return std::chrono::duration<double>(Clock::now() - start).count();
    };
    const Clock::time_point began = Clock::now();
    std::vector<Judged> all;
    int failed = 0;
    for (const Case& one : some) {
      const Clock::time_point start = Clock::now();
      CaseResult result = one.make(options.effort);
      all.push_back({std::string(one.name), std::string(one.sentence), std::move(result), since(start)});
      print_case(all.back());
      for (const Measure& m : all.back().result.measures) failed += m.judged() && !m.holds() ? 1 : 0;
      // Behind each case: what took an hour is kept if the next one is stopped.
      write_report(directory, page_of(all, some.size(), failed, since(began)));
    }
    print_error("talus: validation.csv and report.html in {}\n", directory);
    if (failed > 0) print_error("talus: error: {} numbers are out of their bands\n", failed);
    return failed > 0 ? exit_failure : exit_done;
  } catch (const std::exception& error) {
    print_error("talus: error: {}\n", error.what());
    return exit_failure;
  }
}

}  // namespace talus
