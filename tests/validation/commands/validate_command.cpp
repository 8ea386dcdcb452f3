/// `talus validate` as a user meets it; its short set is the suite's own check against the literature.

#include <gtest/gtest.h>

#include <algorithm>

#include "apps/validate/validation_case.hpp"
#include "tests/unit/io/results/output_helpers.hpp"
#include "tests/validation/commands/command_helpers.hpp"

namespace talus::validate_command_test {
namespace {

using namespace test;

class Validate : public CommandTest {};

TEST_F(Validate, TheShortSetHoldsAndLeavesATableAndAPage) {
  const Outcome outcome = run("validate --short --seeds 1 --out v");
  EXPECT_EQ(outcome.code, 0) << outcome.messages << outcome.output;
  const std::string table = content(at("v/validation.csv"));
  for (const auto& one : literature::cases())
    EXPECT_NE(table.find("\n" + std::string(one.name) + ","), std::string::npos) << one.name;
  EXPECT_EQ(table.find("DOES NOT"), std::string::npos);
  EXPECT_NE(content(at("v/report.html")).find("Agnolin &amp; Roux"), std::string::npos);
}

TEST_F(Validate, ACaseThatNobodyKnowsAndAFolderInUseAreRefused) {
  const Outcome unknown = run("validate lettuce --out v");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_NE(unknown.messages.find("lattice"), std::string::npos) << unknown.messages;
  fs::create_directory(at("mine"));
  write(at("mine/notes.txt"), "mine");
  EXPECT_EQ(run("validate lattice --out mine").code, 2);
  EXPECT_EQ(content(at("mine/notes.txt")), "mine");
}

TEST(Measures, AreJudgedByTheirBandsAndNotWhereThereIsNone) {
  literature::Measure measure{"q/p", 0.7, 0.01, 0.6, 0.8, "somebody"};
  EXPECT_TRUE(measure.judged() && measure.holds());
  measure.value = 0.81;
  EXPECT_FALSE(measure.holds());
  measure.value = std::nan("");
  EXPECT_FALSE(measure.holds()) << "what is no number is in no band";
  EXPECT_FALSE((literature::Measure{"q/p", 0.7}.judged()));
}

}  // namespace
}  // namespace talus::validate_command_test
