/// `talus solve` as a user meets it: its line, its exit codes, its files.

#include <gtest/gtest.h>
#include <hdf5.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "io/fclib/fclib.hpp"

namespace talus {
namespace {

namespace fs = std::filesystem;

struct Outcome {
  int code;
  std::string output;
};

/// Runs the command; stderr comes after stdout when `both`.
Outcome talus(const std::string& arguments, bool both = false) {
  std::FILE* pipe = ::popen((TALUS_COMMAND " " + arguments + (both ? " 2>&1" : " 2>/dev/null")).c_str(), "r");
  Outcome outcome{-1, ""};
  std::array<char, 256> buffer;
  while (std::fgets(buffer.data(), buffer.size(), pipe) != nullptr) outcome.output += buffer.data();
  const int status = ::pclose(pipe);
  if (WIFEXITED(status)) outcome.code = WEXITSTATUS(status);
  return outcome;
}

void write_dataset(hid_t file, const char* name, hid_t type, hsize_t size, const void* data) {
  const hid_t links = H5Pcreate(H5P_LINK_CREATE);
  H5Pset_create_intermediate_group(links, 1);
  const hid_t space = H5Screate_simple(1, &size, nullptr);
  const hid_t set = H5Dcreate2(file, name, type, space, links, H5P_DEFAULT, H5P_DEFAULT);
  H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data);
  H5Dclose(set);
  H5Sclose(space);
  H5Pclose(links);
}

/// A chain of contacts, W = tridiagonal (-1, 2, -1) in each component, hard enough to need many sweeps.
/// `solvable`: without, contact 0 approaches while its whole row of W is zero. With a `diagonal` of 1 both of
/// two contacts cannot open: what one impulse parts it closes elsewhere.
fs::path write_chain(const fs::path& path, int contacts, bool solvable = true, double diagonal = 2) {
  std::vector<int> i, p;
  std::vector<double> x, q, mu(static_cast<std::size_t>(contacts), 0.5);
  for (int c = 0; c < contacts; ++c) {
    for (int k = 0; k < 3; ++k) {
      for (int other = std::max(0, c - 1); other <= std::min(contacts - 1, c + 1) && (solvable || c > 0);
           ++other) {
        i.push_back(3 * c + k);
        p.push_back(3 * other + k);
        x.push_back(other == c ? diagonal : -1);
      }
    }
    q.insert(q.end(), {-1, 0.1, 0});
  }
  const int three = 3, rows = 3 * contacts, nz = static_cast<int>(x.size());
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const auto integer = [&](const char* name, const int& value) {
    write_dataset(file, name, H5T_NATIVE_INT, 1, &value);
  };
  integer("/fclib_local/spacedim", three);
  integer("/fclib_local/W/m", rows);
  integer("/fclib_local/W/n", rows);
  integer("/fclib_local/W/nz", nz);
  integer("/fclib_local/W/nzmax", nz);
  write_dataset(file, "/fclib_local/W/i", H5T_NATIVE_INT, i.size(), i.data());
  write_dataset(file, "/fclib_local/W/p", H5T_NATIVE_INT, p.size(), p.data());
  write_dataset(file, "/fclib_local/W/x", H5T_NATIVE_DOUBLE, x.size(), x.data());
  write_dataset(file, "/fclib_local/vectors/q", H5T_NATIVE_DOUBLE, q.size(), q.data());
  write_dataset(file, "/fclib_local/vectors/mu", H5T_NATIVE_DOUBLE, mu.size(), mu.data());
  H5Fclose(file);
  return path;
}

class SolveCommand : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("talus_solve_" + std::to_string(::getpid()) +
                                           testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(SolveCommand, PrintsOneLineOfJsonAndReturnsZero) {
  const auto problem = write_chain(folder_ / "chain.hdf5", 20);
  const Outcome outcome = talus("solve " + problem.string() + " --tol 1e-6");
  EXPECT_EQ(outcome.code, 0);
  ASSERT_EQ(std::count(outcome.output.begin(), outcome.output.end(), '\n'), 1) << outcome.output;
  const auto line = nlohmann::json::parse(outcome.output);
  EXPECT_EQ(line.size(), 8U);
  EXPECT_EQ(line.at("problem"), "chain");
  EXPECT_EQ(line.at("contacts"), 20);
  EXPECT_EQ(line.at("method"), "auto");
  EXPECT_LE(line.at("error").get<double>(), 1e-6);
  EXPECT_GT(line.at("scaled_error").get<double>(), 0);
  EXPECT_GT(line.at("iterations").get<int>(), 1);
  EXPECT_GT(line.at("seconds").get<double>(), 0);
  EXPECT_TRUE(line.at("converged").get<bool>());
}

TEST_F(SolveCommand, ReturnsThreeWhenTheToleranceIsMissedAndSaysWhy) {
  const auto problem = write_chain(folder_ / "wedged.hdf5", 3, false);
  const Outcome outcome = talus("solve " + problem.string() + " --max-seconds 0.2");
  EXPECT_EQ(outcome.code, 3);
  EXPECT_FALSE(nlohmann::json::parse(outcome.output).at("converged").get<bool>());
  EXPECT_NE(talus("solve " + problem.string() + " --max-seconds 0.2", true).output.find("no solution"),
            std::string::npos);
}

// Impulses grow until the error, which is relative to them, is small.
TEST_F(SolveCommand, SaysWhereContactsStillCloseThoughTheErrorIsSmall) {
  const std::string warns = "not solved: contacts still close";
  const Outcome without = talus("solve " + write_chain(folder_ / "closed.hdf5", 2, true, 1).string(), true);
  EXPECT_EQ(without.code, 3);
  EXPECT_NE(without.output.find(warns), std::string::npos) << without.output;
  const Outcome with = talus("solve " + write_chain(folder_ / "open.hdf5", 2).string(), true);
  EXPECT_EQ(with.output.find(warns), std::string::npos) << with.output;
  const Outcome loose = talus("solve --tol 0.5 " + write_chain(folder_ / "long.hdf5", 40).string(), true);
  EXPECT_EQ(loose.output.find(warns), std::string::npos) << "so much was asked for: " << loose.output;
}

TEST_F(SolveCommand, WritesASolutionThatStandsUpToTheErrorItReports) {
  const auto problem = write_chain(folder_ / "chain.hdf5", 20), out = folder_ / "solved.hdf5";
  const Outcome outcome = talus("solve " + problem.string() + " --out " + out.string());
  ASSERT_EQ(outcome.code, 0);
  const hid_t file = H5Fopen(out.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  ASSERT_GE(file, 0);
  std::vector<double> r(60), u(60), fresh(60);
  for (const auto& [name, values] : {std::pair("/solution/r", &r), std::pair("/solution/u", &u)}) {
    const hid_t set = H5Dopen2(file, name, H5P_DEFAULT);
    ASSERT_GE(H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values->data()), 0);
    H5Dclose(set);
  }
  H5Fclose(file);
  const auto error = delassus_error(io::read_fclib(out), r, fresh);
  EXPECT_EQ(error.siconos, nlohmann::json::parse(outcome.output).at("error").get<double>());
  EXPECT_EQ(u, fresh);
}

TEST_F(SolveCommand, GivesATableOfAFolderAndAllMethodsWithCsvAndProfile) {
  fs::create_directory(folder_ / "set");
  write_chain(folder_ / "set" / "long.hdf5", 30);
  write_chain(folder_ / "set" / "short.hdf5", 2);
  const auto csv = folder_ / "table.csv", profile = folder_ / "profile.csv";
  const Outcome outcome = talus("solve " + (folder_ / "set").string() + " --method all --tol 1e-6 --csv " +
                                csv.string() + " --profile " + profile.string());
  EXPECT_EQ(outcome.code, 0);
  EXPECT_NE(outcome.output.find("newton: 2 of 2 solved"), std::string::npos) << outcome.output;
  const auto lines = [](const fs::path& path) {
    std::ifstream file(path);
    std::vector<std::string> all;
    for (std::string line; std::getline(file, line);) all.push_back(line);
    return all;
  };
  ASSERT_EQ(lines(csv).size(), 1U + 2 * 6);
  EXPECT_EQ(lines(csv)[1].substr(0, 13), "long,30,nlgs,");
  EXPECT_EQ(lines(profile).front(), "factor,nlgs,nlgs+momentum,nncg,admm,newton,auto");
  EXPECT_EQ(lines(profile).back().substr(0, 5), "1000,");
}

TEST_F(SolveCommand, AFolderWithOneBadFileIsSolvedAllTheSameAndSaysTwo) {
  write_chain(folder_ / "good.hdf5", 3);
  std::ofstream(folder_ / "bad.hdf5") << "nothing\n";
  const Outcome outcome = talus("solve " + folder_.string());
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.output.find("auto: 1 of 1 solved"), std::string::npos) << outcome.output;
}

TEST_F(SolveCommand, ReplacesAFileOnlyWhenForced) {
  const auto problem = write_chain(folder_ / "chain.hdf5", 3);
  std::ofstream(folder_ / "thesis.tex") << "mine\n";
  const auto size = fs::file_size(folder_ / "thesis.tex");
  for (const std::string option : {"--out", "--csv", "--profile"}) {
    const std::string command = "solve " + problem.string() + " " + option + " ";
    const Outcome refused = talus(command + (folder_ / "thesis.tex").string(), true);
    EXPECT_EQ(refused.code, 2) << option;
    EXPECT_NE(refused.output.find("--force"), std::string::npos) << refused.output;
    EXPECT_EQ(fs::file_size(folder_ / "thesis.tex"), size) << option;
    ASSERT_EQ(talus(command + (folder_ / "answer").string()).code, 0) << option;
    EXPECT_EQ(talus(command + (folder_ / "answer").string()).code, 2) << option;
    EXPECT_EQ(talus(command + (folder_ / "answer").string() + " --force").code, 0) << option;
    fs::remove(folder_ / "answer");
  }
  const std::string table = (folder_ / "table.csv").string();
  EXPECT_EQ(talus("solve " + problem.string() + " --csv " + table + " --profile " + table).code, 2);
  EXPECT_FALSE(fs::exists(table));
}

TEST_F(SolveCommand, ReturnsOneWhenItsFileCannotBeWritten) {
  const auto problem = write_chain(folder_ / "chain.hdf5", 3);
  for (const std::string option : {"--out", "--csv", "--profile"})
    EXPECT_EQ(talus("solve " + problem.string() + " " + option + " /proc/talus").code, 1) << option;
}

TEST_F(SolveCommand, ReturnsTwoForBadInputWithoutALineOrAFile) {
  const auto problem = write_chain(folder_ / "chain.hdf5", 3);
  const std::string good = "solve " + problem.string();
  for (const std::string& arguments :
       {"solve " + (folder_ / "nowhere.hdf5").string(),
        std::string("solve " TALUS_SOURCE_DIR "/CMakeLists.txt"), good + " --tol 0", good + " --tol nan",
        good + " --max-seconds -1", good + " --method gauss", good + " --measure length",
        good + " --out " + problem.string(), good + " --out " + (folder_ / "no" / "folder.hdf5").string()}) {
    const Outcome outcome = talus(arguments);
    EXPECT_EQ(outcome.code, 2) << arguments;
    EXPECT_EQ(outcome.output, "") << arguments;
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
}

/// `talus study error FOLDER`.
TEST_F(SolveCommand, StudyOfAFolderHoldsEveryMethodAgainstTheFastest) {
  const fs::path problems = folder_ / "problems";
  fs::create_directories(problems);
  write_chain(problems / "short.hdf5", 4);
  write_chain(problems / "long.hdf5", 60);
  const std::string out = (folder_ / "out").string();
  const Outcome outcome = talus(
      "study error " + problems.string() + " --out " + out + " --tolerances 1e-4,1e-6 --max-seconds 5", true);
  ASSERT_EQ(outcome.code, 0) << outcome.output;
  std::ifstream solves(out + "/solves.csv"), profile(out + "/profile.csv");
  std::string line;
  int rows = 0;
  for (std::getline(solves, line); std::getline(solves, line); ++rows)
    EXPECT_TRUE(line.ends_with(",1")) << line;
  EXPECT_EQ(rows % 4, 0) << "two problems at two tolerances, by every method";
  EXPECT_GE(rows, 8);
  double fastest = 0;
  for (std::getline(profile, line); std::getline(profile, line);) {
    std::array<std::string, 4> cells;
    std::stringstream stream(line);
    for (std::string& cell : cells) std::getline(stream, cell, ',');
    const double ratio = std::stod(cells[2]), part = std::stod(cells[3]);
    EXPECT_GE(ratio, 1);
    EXPECT_TRUE(part == 0.5 || part == 1) << line;
    if (ratio == 1 && cells[1] == "0.0001") fastest += part;
  }
  EXPECT_GE(fastest, 1) << "each problem has a fastest method";
  for (const char* name : {"profile.svg", "report.html"}) EXPECT_TRUE(fs::exists(fs::path(out) / name));
  EXPECT_EQ(talus("study error " + problems.string() + " --methods sorcery --out " + out + "2").code, 2);
}

}  // namespace
}  // namespace talus
