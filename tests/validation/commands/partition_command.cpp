/// `talus partition` as a user meets it: the table, the files, and what it refuses.

#include <gtest/gtest.h>

#include <numeric>

#include "partition/partitioners.hpp"
#include "tests/unit/io/results/output_helpers.hpp"
#include "tests/validation/commands/command_helpers.hpp"

namespace talus::partition_command_test {
namespace {

using namespace test;

/// What the command compares unless told otherwise: every partitioner but "auto".
std::vector<std::string> ways() {
  std::vector<std::string> names = partitioner_registry().names();
  std::erase(names, "auto");
  return names;
}

class PartitionCommand : public CommandTest {
 protected:
  std::vector<std::int32_t> field(const std::string& file, const std::string& name) const {
    return array_of<std::int32_t>(content(at(file)), name);
  }

  /// min and max of a row of the table, partitioner after partitioner.
  static std::vector<std::int64_t> row(const std::string& table, const std::string& label) {
    std::vector<std::int64_t> numbers;
    for (const std::string& line : split(table, '\n')) {
      const std::vector<std::string> blocks = split(line, '|');
      if (blocks[0].substr(0, blocks[0].find_last_not_of(' ') + 1) != label) continue;
      for (std::size_t k = 1; k < blocks.size(); ++k) {
        std::istringstream block(blocks[k]);
        std::int64_t low = -1, high = -1;
        block >> low >> high;
        numbers.insert(numbers.end(), {low, high});
      }
    }
    return numbers;
  }
};

using Numbers = std::vector<std::int64_t>;

/// Three grains on a floor: the candidates lie at heights r (floor), 2r and 4r; the plane between two equal
/// boxes at 2.5r. Below it two contacts with the first two grains, above it one with the last two.
TEST_F(PartitionCommand, SharesOutAColumnAsOneDoesByHand) {
  write(at("scene.toml"), column_scene);
  const Outcome outcome = run("partition scene.toml --subdomains 2 --partitioner boxes");
  ASSERT_EQ(outcome.code, 0) << outcome.messages;
  EXPECT_NE(outcome.output.find("3 grains, 3 contacts (1 at walls"), std::string::npos) << outcome.output;
  EXPECT_EQ(row(outcome.output, "bodies"), (Numbers{2, 2}));
  EXPECT_EQ(row(outcome.output, "contacts"), (Numbers{1, 2}));
  EXPECT_EQ(row(outcome.output, "neighbours"), (Numbers{1, 1}));
  EXPECT_EQ(row(outcome.output, "interface bodies"), (Numbers{1, 1}));
  EXPECT_EQ(row(outcome.output, "corner bodies"), (Numbers{0, 0}));
  EXPECT_EQ(field("out/partition-column/partition_boxes.vtp", "multiplicity"),
            (std::vector<std::int32_t>{1, 2, 1}));
  EXPECT_EQ(field("out/partition-column/partition_boxes.vtp", "subdomain"),
            (std::vector<std::int32_t>{0, 1, 1}));
}

TEST_F(PartitionCommand, ComparesAllPartitionersAndWritesTwoFilesForEach) {
  write(at("scene.toml"), pressed_box);
  const Outcome outcome = run("partition scene.toml --subdomains 6 --out cut");
  ASSERT_EQ(outcome.code, 0) << outcome.messages;
  const Numbers bodies = row(outcome.output, "bodies"), contacts = row(outcome.output, "contacts");
  ASSERT_EQ(contacts.size(), 2 * ways().size()) << outcome.output;
  EXPECT_LE(contacts[3] - contacts[2], 2) << "fitted: " << outcome.output;
  EXPECT_LE(contacts[5] - contacts[4], 1) << "rcb: " << outcome.output;
  EXPECT_EQ(files_below(at("cut")).size(), 2 * ways().size());
  for (std::size_t k = 0; const std::string& name : ways()) {
    const auto multiplicity = field("cut/partition_" + name + ".vtp", "multiplicity");
    const auto subdomain = field("cut/partition_" + name + ".vtp", "subdomain");
    ASSERT_EQ(multiplicity.size(), 400U);
    EXPECT_GE(*std::ranges::min_element(multiplicity), 1) << "every grain stands somewhere";
    EXPECT_EQ(std::set<std::int32_t>(subdomain.begin(), subdomain.end()),
              (std::set<std::int32_t>{0, 1, 2, 3, 4, 5}));
    const std::int64_t copies = std::accumulate(multiplicity.begin(), multiplicity.end(), std::int64_t{0});
    EXPECT_LE(6 * bodies[k], copies) << name;
    EXPECT_GE(6 * bodies[k + 1], copies) << name;
    EXPECT_NE(content(at("cut/partition_" + name + ".svg")).find("multiplicity"), std::string::npos);
    k += 2;
  }
}

TEST_F(PartitionCommand, OneSubdomainHasEverythingAndNoInterface) {
  write(at("scene.toml"), pressed_box);
  const Outcome outcome = run("partition scene.toml --subdomains 1");
  ASSERT_EQ(outcome.code, 0) << outcome.messages;
  EXPECT_EQ(row(outcome.output, "bodies"), Numbers(2 * ways().size(), 400));
  for (const std::string label : {"neighbours", "neighbours, walls too", "interface bodies", "corner bodies"})
    EXPECT_EQ(row(outcome.output, label), Numbers(2 * ways().size(), 0)) << label;
}

TEST_F(PartitionCommand, RefusesASceneThatBeginsWithoutGrains) {
  const std::size_t sample = cell_scene.find("[cell]");
  write(at("scene.toml"), cell_scene.substr(0, sample) + R"([[insert]]
radius = 0.01
count = 3
region = { shape = "box", low = [0, 0, 0], high = [0.1, 0.1, 0.1] }
[[stage]]
end = { steps = 3 }
)");
  const Outcome outcome = run("partition scene.toml --subdomains 2");
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.messages.find("there is nothing to cut"), std::string::npos) << outcome.messages;
}

TEST_F(PartitionCommand, SaysTheSameOnAnyNumberOfThreads) {
  write(at("scene.toml"), pressed_box);
  const std::string command = "partition scene.toml --subdomains 12 --out ";
  const Outcome one = run(command + "one --threads 1"), three = run(command + "three --threads 3");
  ASSERT_EQ(one.code, 0) << one.messages;
  EXPECT_EQ(one.output, three.output);
  EXPECT_EQ(files_below(at("one")), files_below(at("three")));
}

TEST_F(PartitionCommand, MoreSubdomainsThanContactsLeaveSomeEmpty) {
  write(at("scene.toml"), column_scene);
  const Outcome outcome = run("partition scene.toml --subdomains 64");
  ASSERT_EQ(outcome.code, 0) << outcome.messages;
  Numbers none_or_one;
  for (std::size_t k = 0; k < ways().size(); ++k) none_or_one.insert(none_or_one.end(), {0, 1});
  EXPECT_EQ(row(outcome.output, "contacts"), none_or_one);
}

TEST_F(PartitionCommand, AutoSaysWhatItIs) {
  write(at("scene.toml"), column_scene);
  const Outcome outcome = run("partition scene.toml --subdomains 2 --partitioner auto");
  ASSERT_EQ(outcome.code, 0) << outcome.messages;
  EXPECT_NE(outcome.output.find("auto is rcb"), std::string::npos) << outcome.output;
}

TEST_F(PartitionCommand, SaysWhenNothingTouches) {
  write(at("scene.toml"), column_scene);
  const Outcome outcome =
      run("partition scene.toml --subdomains 2 --set sample.spacing=2 --set wall.floor.position=-1");
  ASSERT_EQ(outcome.code, 0) << outcome.messages;
  EXPECT_NE(outcome.messages.find("no contacts"), std::string::npos) << outcome.messages;
  EXPECT_EQ(row(outcome.output, "contacts"), Numbers(2 * ways().size(), 0));
}

TEST_F(PartitionCommand, CutsTheBoxesOfTheScene) {
  write(at("scene.toml"), column_scene + "[decomposition]\nboxes = [1, 3, 1]\n");
  const Outcome outcome = run("partition scene.toml --subdomains 3 --partitioner boxes");
  ASSERT_EQ(outcome.code, 0) << outcome.messages;
  // All grains stand above one another: chosen boxes would lie so too.
  EXPECT_EQ(field("out/partition-column/partition_boxes.vtp", "multiplicity"),
            (std::vector<std::int32_t>{1, 1, 1}));
  const Outcome others = run("partition scene.toml --subdomains 2 --out other");
  EXPECT_EQ(others.code, 2);
  EXPECT_NE(others.messages.find("decomposition.boxes"), std::string::npos) << others.messages;
  EXPECT_EQ(run("partition scene.toml --subdomains 2 --out other --partitioner rcb").code, 0)
      << "it cuts no boxes";
}

TEST_F(PartitionCommand, ReplacesItsOwnFilesOnlyAndOnlyWithForce) {
  write(at("scene.toml"), column_scene);
  const std::string command = "partition scene.toml --subdomains 2 --out cut";
  ASSERT_EQ(run(command).code, 0);
  write(at("cut/run.json"), "a run's");
  write(at("cut/notes.txt"), "mine");
  const auto before = files_below(folder_.path());
  const Outcome refused = run(command + " --partitioner rcb");
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.messages.find("--force"), std::string::npos) << refused.messages;
  EXPECT_EQ(files_below(folder_.path()), before);
  ASSERT_EQ(run(command + " --partitioner rcb --force").code, 0);
  std::set<std::string> names;
  for (const auto& [name, text] : files_below(at("cut"))) names.insert(name);
  EXPECT_EQ(names,
            (std::set<std::string>{"notes.txt", "partition_rcb.svg", "partition_rcb.vtp", "run.json"}));
  EXPECT_EQ(content(at("cut/run.json")), "a run's");
}

TEST_F(PartitionCommand, RefusesWhatHasNoMeaningAndWritesNothing) {
  write(at("scene.toml"), column_scene);
  for (const std::string arguments :
       {"", "scene.toml", "scene.toml --subdomains 0", "scene.toml --subdomains -3",
        "scene.toml --subdomains 2 --partitioner boxers", "scene.toml --subdomains 2 --threads 0",
        "missing.toml --subdomains 2", "scene.toml --subdomains 2 --set sample.spacing=0"}) {
    const Outcome outcome = run("partition " + arguments);
    EXPECT_EQ(outcome.code, 2) << arguments;
    EXPECT_NE(outcome.messages.find("error"), std::string::npos) << arguments << outcome.messages;
    EXPECT_EQ(files_below(folder_.path()).size(), 1U) << arguments;
  }
}

TEST_F(PartitionCommand, AFileThatCannotBeWrittenIsAFailureAndLeavesNoHalf) {
  write(at("scene.toml"), pressed_box);
  const Outcome outcome = run("partition scene.toml --subdomains 4 --out cut", "ulimit -f 8;");
  EXPECT_EQ(outcome.code, 1) << outcome.messages;
  EXPECT_NE(outcome.messages.find("partition_boxes"), std::string::npos) << outcome.messages;
  for (const auto& [name, text] : files_below(at("cut"))) EXPECT_FALSE(name.ends_with(".part")) << name;
}

}  // namespace
}  // namespace talus::partition_command_test
