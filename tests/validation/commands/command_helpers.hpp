#pragma once

/// What the tests of the built command share: running it, small scenes, reading what it left behind.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/unit/io/results/output_helpers.hpp"

namespace talus::test {

namespace fs = std::filesystem;

inline std::string content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path.string());
  return {std::istreambuf_iterator<char>(file), {}};
}

inline void write(const fs::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

struct Outcome {
  int code = -1;  ///< exit code; -1 when a signal ended the command
  std::string output, messages;
};

/// Runs a shell line that ends in the command, e.g. "talus run scene.toml"; `folder` is the working directory
/// and takes the messages while it runs.
inline Outcome run(const fs::path& folder, const std::string& arguments, const std::string& before = "") {
  const fs::path messages = folder / "stderr.txt";
  const std::string line = "cd '" + folder.string() + "' && " + before + " '" TALUS_COMMAND "' " + arguments +
                           " 2>'" + messages.string() + "'";
  std::FILE* pipe = ::popen(line.c_str(), "r");
  if (pipe == nullptr) throw std::runtime_error("cannot run " + line);
  Outcome outcome;
  std::array<char, 4096> buffer;
  while (std::fgets(buffer.data(), buffer.size(), pipe) != nullptr) outcome.output += buffer.data();
  const int status = ::pclose(pipe);
  if (WIFEXITED(status)) outcome.code = WEXITSTATUS(status);
  outcome.messages = content(messages);
  fs::remove(messages);
  return outcome;
}

/// Every file below a folder with its content: what must not have changed.
inline std::map<std::string, std::string> files_below(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      files[entry.path().lexically_relative(folder).string()] = content(entry.path());
  return files;
}

/// A table of a run, by the names of its columns. No cell of these tests holds a comma.
struct Table {
  std::string header;
  std::vector<std::map<std::string, std::string>> rows;

  double number(std::size_t row, const std::string& column) const {
    return std::stod(rows.at(row).at(column));
  }
};

inline Table read_table(const fs::path& path) {
  std::istringstream text(content(path));
  const auto cells = [](const std::string& line) {
    std::vector<std::string> row;
    std::string cell;
    for (std::istringstream stream(line); std::getline(stream, cell, ',');) row.push_back(cell);
    return row;
  };
  Table table;
  std::getline(text, table.header);
  const std::vector<std::string> names = cells(table.header);
  for (std::string line; std::getline(text, line);) {
    const std::vector<std::string> row = cells(line);
    if (row.size() != names.size())
      throw std::runtime_error(path.string() + ": a line with another number of cells: " + line);
    for (table.rows.emplace_back(); const std::string& name : names)
      table.rows.back()[name] = row[table.rows.back().size()];
  }
  return table;
}

inline nlohmann::json summary(const fs::path& results) {
  return nlohmann::json::parse(content(results / "run.json")).at("summary");
}

/// A folder of its own for each test, and the command run in it.
class CommandTest : public testing::Test {
 protected:
  Outcome run(const std::string& arguments, const std::string& before = "") const {
    return test::run(folder_.path(), arguments, before);
  }
  fs::path at(const std::string& name) const { return folder_.path() / name; }

  ScratchDirectory folder_;
};

/// A pressed box of grains with friction: walls of finite mass, contacts, two stages. Some 0.1 s a run.
inline const std::string pressed_box = R"(name = "box"
box = true
time_step = 1e-3

[material]
density = 2600
friction = 0.35

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
end = { steps = 6 }

[[stage]]
name = "shear"
end = { steps = 6 }

[[stage.load]]
wall = "z+"
drive = "velocity"
velocity = [0, 0, -0.05]

[solver]
tolerance = 1e-2
balance_tolerance = 0.5

[output]
every_steps = 4
)";

/// Twenty grains in a periodic cube.
inline const std::string cell_scene = R"(time_step = 1e-3

[material]
density = 2600

[cell]
lengths = [0.1, 0.1, 0.1]

[sample]
kind = "random"
count = 20
radius = 0.005

[[stage]]
end = { steps = 3 }
)";

/// Three grains on a floor, a column that no single sweep solves.
inline const std::string column_scene = R"(name = "column"
gravity = [0, 0, -9.81]
time_step = 1e-3

[material]
density = 2600
friction = 0.35

[sample]
kind = "lattice"
cells = [1, 1, 3]
spacing = 1
radius = 0.01

[[wall]]
name = "floor"
side = "z-"

[[stage]]
name = "rest"
end = { steps = 4 }
)";

/// The scene with its grains in grains.csv.
inline std::string with_bodies(std::string scene) {
  const std::size_t begin = scene.find("kind = "), end = scene.find("[[wall]]");
  return scene.replace(begin, end - begin, "kind = \"bodies\"\nfile = \"grains.csv\"\n\n");
}

}  // namespace talus::test
