#pragma once

/// What the tests of several ranks share: mpirun in front of the command, a folder of their own.

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "io/results/results.hpp"
#include "tests/unit/io/results/output_helpers.hpp"
#include "tests/validation/commands/command_helpers.hpp"

namespace talus::test {

/// mpirun for so many ranks, also as root, also on fewer cores.
inline std::string launcher(int ranks) {
  return "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 mpirun --oversubscribe --bind-to none "
         "-n " +
         std::to_string(ranks);
}

/// A column of a table left out: the time that a step took is of the day.
inline std::string without(const std::string& table, const std::string& column) {
  std::istringstream lines(table);
  std::string kept;
  std::ptrdiff_t place = -1;
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> cells;
    std::istringstream row(line);
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    if (place < 0) place = std::ranges::find(cells, column) - cells.begin();
    for (std::size_t k = 0; k < cells.size(); ++k)
      if (static_cast<std::ptrdiff_t>(k) != place) kept += cells[k] + ',';
    kept += '\n';
  }
  return kept;
}

class OnRanks : public CommandTest {
 protected:
  /// Without mpirun when `ranks` is 1.
  Outcome run(int ranks, const std::string& arguments, const std::string& environment = "") const {
    return test::run(folder_.path(), arguments,
                     environment + " " + (ranks > 1 ? launcher(ranks) : std::string()));
  }
  /// Ranks and threads of each.
  using Layouts = std::vector<std::pair<int, int>>;
  /// Runs scene.toml in so many subdomains, alone as `one` and then on each layout that has no more ranks:
  /// each ends well, with the digest, the steps.csv and the walls.csv of the one alone. also(out): what else
  /// is compared.
  void expect_same_bits(int subdomains, const Layouts& layouts, const std::string& one,
                        const std::function<void(const std::string& out)>& also = {}) const {
    const std::string command = fmt::format("run scene.toml --set decomposition.subdomains={}", subdomains);
    const Outcome alone = run(1, fmt::format("{} --out {} --threads 1", command, one));
    ASSERT_EQ(alone.code, 0) << alone.messages;
    for (const auto& [ranks, threads] : layouts) {
      if (ranks > subdomains) continue;
      const std::string out = fmt::format("s{}r{}x{}", subdomains, ranks, threads);
      const Outcome other = run(ranks, fmt::format("{} --out {} --threads {}", command, out, threads));
      ASSERT_EQ(other.code, 0) << out << ": " << other.messages;
      EXPECT_EQ(digest_of(out), digest_of(one)) << out;
      EXPECT_EQ(file(out, "walls.csv"), file(one, "walls.csv")) << out;
      EXPECT_EQ(without(file(out, "steps.csv"), "wall_s"), without(file(one, "steps.csv"), "wall_s")) << out;
      if (also) also(out);
    }
  }
  /// The last frame of results.h5.
  Frame last_frame(const std::string& out) const {
    const fs::path path = at(out) / "results.h5";
    return io::read_frame(path, io::frame_count(path) - 1);
  }
  std::string digest_of(const std::string& out) const { return summary(at(out)).at("digest"); }
  std::string file(const std::string& out, const std::string& name) const { return content(at(out) / name); }
};

/// 300 grains between a moving lid and five fixed walls, in six subdomains, dealt out anew every third step.
/// Steps that miss are allowed: mpirun takes a second or two to end ranks whose exit code is not 0.
inline const std::string six_subdomains = R"(name = "ranks"
box = true
allow_unconverged = true
time_step = 1e-3
[material]
density = 2600
friction = 0.3
[sample]
kind = "deposition"
count = 400
base = [0.12, 0.12]
radius_distribution = "uniform"
radius_min = 0.008
radius_max = 0.012
[[wall]]
name = "z+"
drive = "pressure"
pressure = 1e4
[[stage]]
name = "press"
friction = 0
end = { steps = 5 }
[[stage]]
name = "hold"
end = { steps = 5 }
[solver]
max_iterations = 40
[decomposition]
subdomains = 6
repartition_every = 3
[output]
every_steps = 4
pictures = false
)";

}  // namespace talus::test
