/// How many threads a run takes when nobody says how many.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/validation/commands/command_helpers.hpp"

namespace talus::threads_of_run_test {
namespace {

using namespace test;

class ThreadsOfARun : public CommandTest {
 protected:
  /// Grains that touch nothing, for a step.
  void write_scene(int grains, const std::string& more = "") const {
    write(at("scene.toml"), fmt::format(R"(time_step = 1e-3
[material]
density = 2600
[sample]
kind = "lattice"
count = {}
base = [0.4, 0.4]
radius = 0.01
{}
[output]
pictures = false
[[stage]]
name = "fly"
end = {{ steps = 1 }}
)",
                                        grains, more));
  }
  nlohmann::json provenance(const std::string& options = "") const {
    const Outcome outcome = run("run scene.toml --out out --force " + options);
    EXPECT_EQ(outcome.code, 0) << outcome.messages;
    return nlohmann::json::parse(content(at("out/run.json"))).at("provenance");
  }
};

TEST_F(ThreadsOfARun, AreNoMoreThanThereAreCoresAndThousandsOfGrains) {
  for (const int grains : {1, 3999, 4000, 6100}) {
    write_scene(grains);
    const nlohmann::json run = provenance();
    EXPECT_EQ(run.at("threads"), std::clamp(grains / 2000, 1, run.at("cores_allowed").get<int>())) << grains;
  }
}

TEST_F(ThreadsOfARun, AreAsManyAsAskedFor) {
  write_scene(8);
  EXPECT_EQ(provenance("--threads 3").at("threads"), 3);
}

TEST_F(ThreadsOfARun, CountGrainsToComeAndAreOneForEachCoreWhereNobodyKnowsHowMany) {
  const std::string insert = R"([[insert]]
radius = 0.01
region = { shape = "box", low = [1, 1, 1], high = [2, 2, 2] }
)";
  write_scene(8, insert + "count = 3");
  EXPECT_EQ(provenance().at("threads"), 1);
  for (const char* more : {"count = 5000", "mass_rate = 1.0"}) {
    write_scene(8, insert + more);
    const nlohmann::json run = provenance();
    EXPECT_EQ(run.at("threads"), std::min(2, run.at("cores_allowed").get<int>())) << more;
  }
}

TEST_F(ThreadsOfARun, ThatGoesOnFollowFromItsGrains) {
  write_scene(4000);
  provenance("--threads 1 --set checkpoint.every_steps=1");
  const std::string line =
      "run scene.toml --out out --resume --set checkpoint.every_steps=1 --set stage.fly.end.steps=";
  EXPECT_EQ(run(line + "3").code, 0);
  const auto again = nlohmann::json::parse(content(at("out/run.json"))).at("provenance");
  EXPECT_EQ(again.at("threads"), std::min(2, again.at("cores_allowed").get<int>()));
}

}  // namespace
}  // namespace talus::threads_of_run_test
