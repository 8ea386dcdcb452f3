/// What `[output]` thins, seen from outside.

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "io/results/results.hpp"
#include "tests/validation/commands/command_helpers.hpp"

namespace talus::command_output_test {
namespace {

using namespace test;

class ThinnedOutput : public CommandTest {};

TEST_F(ThinnedOutput, HasEveryThirdLineOfWallsAndStressesAndEveryLineOfSteps) {
  write(at("scene.toml"), pressed_box);
  ASSERT_EQ(run("run scene.toml --out all").code, 0);
  ASSERT_EQ(run("run scene.toml --out thin --set output.tables_every=3").code, 0);
  EXPECT_EQ(summary(at("thin")).at("digest"), summary(at("all")).at("digest"));
  for (const char* name : {"walls.csv", "triaxial.csv"}) {
    const Table all = read_table(at("all") / name), thin = read_table(at("thin") / name);
    std::size_t next = 0;
    for (const auto& row : all.rows)
      if (std::stoi(row.at("step")) % 3 == 0) {
        ASSERT_LT(next, thin.rows.size()) << name;
        EXPECT_EQ(thin.rows[next++], row) << name;
      }
    EXPECT_EQ(next, thin.rows.size()) << name;
    EXPECT_GT(next, 0U) << name;
  }
  EXPECT_EQ(read_table(at("thin/steps.csv")).rows.size(), 12U);
}

TEST_F(ThinnedOutput, HasContactsInEverySecondFrame) {
  write(at("scene.toml"), pressed_box);
  ASSERT_EQ(run("run scene.toml --out out --set output.contacts_every=2 --set output.every_steps=2").code, 0);
  const fs::path results = at("out/results.h5");
  const std::size_t frames = io::frame_count(results);
  ASSERT_GT(frames, 4U);
  std::size_t with = 0;
  for (std::size_t k = 1; k < frames; ++k) {
    const bool has = !io::read_frame(results, k).contact_bodies.empty();
    EXPECT_EQ(has, k % 2 == 0) << k;
    with += has ? 1 : 0;
  }
  EXPECT_GT(with, 1U);
}

TEST_F(ThinnedOutput, OfARunIsDrawnAndToldWithoutReplacingWhatSomebodyElseWrote) {
  write(at("scene.toml"), pressed_box);
  ASSERT_EQ(run("run scene.toml --out out").code, 0);
  write(at("notes.html"), "mine");
  EXPECT_EQ(run("report out --out notes.html").code, 2);
  EXPECT_EQ(content(at("notes.html")), "mine");
  EXPECT_EQ(run("report out --out notes.html --force").code, 0);
  EXPECT_NE(content(at("notes.html")), "mine");
  EXPECT_EQ(run("report out").code, 0) << "its own page is made anew";
  for (const char* angle : {"--azimuth nan", "--azimuth inf", "--elevation nan"})
    EXPECT_EQ(run(std::string("view out -o view.png ") + angle).code, 2) << angle;
  EXPECT_FALSE(fs::exists(at("view.png")));
  EXPECT_EQ(run("view out -o view.xyz").code, 2) << "a picture is no table of grains";
  EXPECT_FALSE(fs::exists(at("view.xyz")));
}

class ColumnDictionary : public CommandTest {
 protected:
  /// Runs the scene; `tables` are the tables that it is to write.
  void expect_every_column_told(const std::string& scene, const std::set<std::string>& tables) {
    write(at("scene.toml"), scene);
    const Outcome outcome = run("run scene.toml --out out --force");
    ASSERT_EQ(outcome.code, 0) << outcome.messages;
    const auto told = nlohmann::json::parse(content(at("out/columns.json")));
    std::set<std::string> written;
    for (const auto& entry : fs::directory_iterator(at("out"))) {
      if (entry.path().extension() != ".csv") continue;
      const std::string table = entry.path().filename().string();
      written.insert(table);
      std::string names;
      for (const auto& column : told.at(table)) {
        names += (names.empty() ? "" : ",") + column.at("name").get<std::string>();
        EXPECT_FALSE(column.at("meaning").get<std::string>().empty()) << table << column;
      }
      std::string header;
      std::ifstream file(entry.path());
      std::getline(file, header);
      EXPECT_EQ(names, header) << table;
    }
    EXPECT_EQ(written, tables);
  }
};

TEST_F(ColumnDictionary, SaysOfEveryColumnThatARunWritesWhatItIs) {
  expect_every_column_told(
      R"(time_step = 1e-3
gravity = [0, 0, -9.81]
[[material]]
name = "glass"
density = 2500
[[material]]
name = "steel"
density = 7800
[[sample]]
kind = "body"
name = "ball"
position = [0, 0, 0.05]
radius = 0.05
[[insert]]
radius = 0.01
count = 3
region = { shape = "box", low = [0.1, 0.1, 0.1], high = [0.3, 0.3, 0.3] }
[[remove]]
region = { shape = "beyond", point = [9, 0, 0], normal = [1, 0, 0] }
[[probe]]
region = { shape = "box", low = [-1, -1, 0], high = [1, 1, 1] }
[[wall]]
name = "z-"
position = 0
[[stage]]
end = { steps = 3 }
)",
      {"bodies.csv", "inserted.csv", "probes.csv", "removed.csv", "steps.csv", "walls.csv"});
  expect_every_column_told(cell_scene, {"cell.csv", "steps.csv", "triaxial.csv", "walls.csv"});
}

}  // namespace
}  // namespace talus::command_output_test
