/// Where time went, what was left out, how to repeat and cite; and the pictures that the run made.

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <numeric>

#include "apps/report/sections.hpp"
#include "io/files/detail/with_unit.hpp"
#include "io/trace/trace_file.hpp"
#include "runtime/trace/analysis.hpp"

namespace talus {

namespace {

namespace fs = std::filesystem;

double total(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

/// What `talus trace show` says, "" without a trace.
std::string trace_text(const fs::path& path) {
  if (!fs::exists(path)) return {};
  try {
    return trace::describe(trace::analyse(io::read_trace(path.string())));
  } catch (const std::exception& error) {
    return error.what();
  }
}

/// A word of a shell, quoted where it has to be.
std::string shell_word(const std::string& word) {
  constexpr std::string_view plain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./=+,:@%";
  if (!word.empty() && word.find_first_not_of(plain) == std::string::npos) return word;
  std::string quoted = "'";
  for (const char letter : word) quoted += letter == '\'' ? std::string("'\\''") : std::string(1, letter);
  return quoted + "'";
}

std::string text_of(const nlohmann::json& object, const char* key) {
  const auto found = object.find(key);
  if (found == object.end() || found->is_null()) return "";
  return found->is_string() ? found->get<std::string>() : found->dump();
}

}  // namespace

HtmlSections picture_section(const RunFolder& run) {
  constexpr std::uintmax_t most_bytes = 2 << 20;
  std::vector<fs::path> pictures;
  for (const auto& entry : fs::directory_iterator(run.directory))
    // Its curves are drawn above, as those of the other tables.
    if (entry.path().extension() == ".svg" && entry.path().filename() != "triaxial.svg")
      pictures.push_back(entry.path());
  std::sort(pictures.begin(), pictures.end());
  io::HtmlSection section{"Pictures", ""};
  for (const fs::path& path : pictures) {
    if (fs::file_size(path) > most_bytes) {
      section.text += fmt::format("{} is too large for this page. ", path.filename().string());
      continue;
    }
    std::ifstream file(path, std::ios::binary);
    section.figures.push_back(
        {std::string(std::istreambuf_iterator<char>(file), {}), path.filename().string(), true});
  }
  return pictures.empty() ? HtmlSections{} : HtmlSections{section};
}

HtmlSections time_section(const RunFolder& run) {
  const auto &elapsed = run.steps["wall_s"], &sweeps = run.steps["iterations"], &time = run.steps["time"];
  if (elapsed.empty()) return {};
  const double seconds = total(elapsed), all_sweeps = total(sweeps);
  const double contacts =
      std::inner_product(sweeps.begin(), sweeps.end(), run.steps["contacts"].begin(), 0.0);
  io::HtmlSection section{"Where time went", ""};
  section.table.rows = {
      {"steps", fmt::format("{} in {:.4g} s elapsed: {} a step", elapsed.size(), seconds,
                            io::detail::with_unit(seconds / static_cast<double>(elapsed.size()), "s"))},
      {"simulated", fmt::format("{:.6g} s: {:.3g} s elapsed for each", time.back(),
                                seconds / std::max(time.back(), 1e-300))},
      {"sweeps", fmt::format("{:.0f}, {:.3g} a step; all of a step's time over its sweeps and contacts: {}",
                             all_sweeps, all_sweeps / static_cast<double>(elapsed.size()),
                             io::detail::with_unit(seconds / std::max(contacts, 1.0), "s"))},
      {"threads",
       text_of(run.provenance, "threads") + " a rank, instructions " + text_of(run.provenance, "simd")},
  };
  io::Chart of_steps = small_chart("Sweeps of a step, largest of each stretch", "time [s]", "sweeps", true);
  of_steps.series.push_back({"", thinned(time, sweeps, Thinned::largest), 0});
  if (run.scene)
    of_steps.levels.push_back(
        {static_cast<double>(run.scene->setup.solver.max_iterations), "most that are made"});
  io::Chart of_time =
      small_chart("Elapsed time of a step, largest of each stretch", "time [s]", "elapsed [s]", true);
  of_time.series.push_back({"", thinned(time, elapsed, Thinned::largest), 1});
  section.figures = {{io::draw_chart(of_steps), ""}, {io::draw_chart(of_time), ""}};
  section.code = trace_text(run.directory / "trace.h5");
  if (section.code.empty())
    section.text = "Tasks were not recorded; a run with --trace says how long each phase took.";
  return {section};
}

HtmlSections left_out_section(const RunFolder& run) {
  if (!run.scene) return {};
  const Setup& setup = run.scene->setup;
  const auto any_law = [&](LawNumber number) {
    return std::any_of(setup.stages.begin(), setup.stages.end(),
                       [&](const Stage& stage) { return stage.laws.largest(number) > 0; });
  };
  io::HtmlTable out;
  const auto line = [&](bool is_out, const char* what, const char* saves) {
    if (is_out) out.rows.push_back({what, saves});
  };
  const bool frictionless = std::any_of(setup.stages.begin(), setup.stages.end(), [](const Stage& stage) {
    return stage.laws.largest(&PairLaw::friction) == 0;
  });
  line(!any_law(&PairLaw::friction), "friction",
       "one component of impulse per contact instead of three, no angular velocities");
  line(any_law(&PairLaw::friction) && frictionless, "friction in some stages",
       "there one component of impulse per contact");
  line(!setup.rotation, "rotation", "no levers in the sweeps, no angular velocities");
  line(!setup.orientation && setup.clumps.empty(), "orientations", "32 bytes a grain; spheres need none");
  for (const Attraction* attraction : attractions)
    line(!any_law(*attraction), attraction->name, "no such force between grains");
  line(!any_law(&PairLaw::rolling_resistance), "rolling resistance", "no moments at contacts");
  line(!any_law(&PairLaw::restitution), "restitution", "no velocities of before the step at contacts");
  line(setup.clumps.empty(), "shapes other than spheres", "contacts are diagonal: no 3x3 problems");
  line(setup.solver.overlap_correction == 0, "correction of overlaps", "no sweeps of positions");
  line(setup.decomposition.subdomains <= 1, "subdomains", "no interface, no gluing, no messages");
  line(setup.inserts.empty() && setup.removes.empty(), "grains that come or go",
       "no new numbering of grains");
  line(!fs::exists(run.directory / "trace.h5"), "trace", "no clock is read in the sweeps");
  if (out.rows.empty()) return {};
  return {{"What was left out",
           "What a scene does not need is not there; `talus plan SCENE --measure` measures what that saves.",
           "", std::move(out)}};
}

HtmlSections repeat_section(const RunFolder& run) {
  io::HtmlSection section{"How to repeat and cite it", ""};
  std::string line;
  for (const auto& word : run.provenance.value("command_line", nlohmann::json::array()))
    if (word.is_string()) line += (line.empty() ? "" : " ") + shell_word(word.get<std::string>());
  const std::string version = text_of(run.provenance, "version"),
                    commit = text_of(run.provenance, "git_hash");
  const std::string digest = text_of(run.summary, "digest");
  section.text =
      "Two runs end in the same state, bit for bit, if their digests are equal; numbers of ranks and threads "
      "do not change it.";
  const bool dirty = run.provenance.value("git_dirty", false);
  section.table.rows = {
      {"version", version + ", commit " + commit + (dirty ? " with changes that are in no commit" : "")},
      {"digest", digest.empty() ? "none: the run has not ended" : digest},
      {"scene", text_of(run.provenance, "scene_file") + ", seed " + text_of(run.provenance, "seed")},
      {"compiler", text_of(run.provenance, "compiler") + " " + text_of(run.provenance, "flags")},
      {"machine", text_of(run.provenance, "host") + ", " + text_of(run.provenance, "cores_allowed") +
                      " cores for the process"},
      {"begun", text_of(run.provenance, "date_utc")},
  };
  for (const auto& resumed : run.provenance.value("resumed", nlohmann::json::array()))
    section.table.rows.push_back(
        {"gone on", text_of(resumed, "date_utc") + " behind step " + text_of(resumed, "step")});
  section.code =
      line + "\n\n" +
      fmt::format(
          "@software{{talus,\n  title = {{Talus: dense granular matter by nonsmooth contact dynamics}},\n"
          "  version = {{{}}},\n  note = {{commit {}; run with digest {}}}\n}}\n",
          version, commit, digest.empty() ? "of a run that goes on" : digest);
  section.folded = run.resolved;
  section.fold = "The scene with every default (scene.resolved.toml)";
  return {section};
}

}  // namespace talus
