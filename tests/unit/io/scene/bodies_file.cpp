#include "io/scene/bodies_file.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "io/scene/scene_error.hpp"

namespace talus::io {
namespace {

/// A CSV file that lives as long as the test that made it.
class CsvBodies : public ::testing::Test {
 protected:
  std::string write(const std::string& text) {
    path_ = ::testing::TempDir() + "talus_bodies_" +
            ::testing::UnitTest::GetInstance()->current_test_info()->name() + ".csv";
    std::ofstream(path_) << text;
    return path_;
  }
  void TearDown() override { std::filesystem::remove(path_); }

  void expect_refused(const std::string& text, int line, const std::string& column, const std::string& said) {
    const std::string path = write(text);
    try {
      read_bodies(path, 1);
      ADD_FAILURE() << "accepted: " << text;
    } catch (const SceneError& error) {
      EXPECT_EQ(error.file(), path);
      EXPECT_EQ(error.line(), line) << error.what();
      EXPECT_EQ(error.key(), column);
      EXPECT_NE(std::string(error.what()).find(said), std::string::npos) << error.what();
    }
  }

 private:
  std::string path_;
};

TEST_F(CsvBodies, AngularVelocityBecomesSurfaceVelocity) {
  const std::string path =
      write("id,x,y,z,radius,vx,vy,vz,wx,wy,wz\r\n# a comment\n\n7, +1,2,3,0.5,4,5,6,7,8,9\r\n");
  Bodies bodies, sliding;
  append(read_bodies(path, 1000), bodies);
  append(read_bodies(path, 1000, false), sliding);
  ASSERT_EQ(bodies.size(), 1u);
  EXPECT_EQ(bodies.id[0], BodyId{7});
  EXPECT_EQ(bodies.x[0], Vec3(1, 2, 3));
  EXPECT_EQ(bodies.velocity[0].u[1], 5);
  EXPECT_EQ(bodies.velocity[0].w[2], 4.5);
  EXPECT_EQ(sliding.velocity[0].w[2], 0);
}

TEST_F(CsvBodies, AMarkOfUtf8IsNoMistake) {
  EXPECT_EQ(read_bodies(write("\xef\xbb\xbfid,x,y,z,radius\n7,0,0,0,1\n"), 1).id.at(0), BodyId{7});
  expect_refused(
      "id,x,y,z,radius\n\xef\xbb\xbf"
      "1,0,0,0,1\n",
      2, "id", "is not an integer");
}

TEST_F(CsvBodies, MistakesAreFoundWithLineAndColumn) {
  expect_refused("id,x,y,z,radius\n1,0,0,0,1\n2,0,0,0,-1\n", 3, "radius", "must be > 0 m, got -1");
  expect_refused("id,x,y,z,radius\n1,0,0,zero,1\n", 2, "z", "'zero' is not a number");
  expect_refused("id,x,y,z,radius\n1,0,0,1e400,1\n", 2, "z", "1e400 is out of the range of numbers");
  expect_refused("id,x,y,z,radius\n1,nan,0,0,1\n", 2, "x", "must be finite");
  expect_refused("id,x,y,z,radius\n1.5,0,0,0,1\n", 2, "id", "'1.5' is not an integer");
  expect_refused("id,x,y,z,radius\n1,0,0,0\n", 2, "", "5 fields expected as in the header, got 4");
  expect_refused("id,x,y,z,radius\n1,0,0,0,1,2\n", 2, "", "5 fields expected");
  expect_refused("id,x,y,z,radius\n1,0,0,0,1\n1,0,0,2,1\n", 3, "id", "1 stands already on line 2");
  // Grains that are inserted have ids beyond the largest, and balls of clumps several each.
  expect_refused("id,x,y,z,radius\n9223372036854775807,0,0,0,1\n", 2, "id", "must be 0 to 1000000000000000");
  expect_refused("id,x,y,z,radius\n1,0,-1.5e15,0,1\n", 2, "y", "must be within 1e+15, got -1.5e15");
  expect_refused("x,y,z,r\n0,0,0,1\n", 1, "", "the first line must be");
  expect_refused("id,x,y,z,radius\n", 1, "", "no bodies");
}

TEST_F(CsvBodies, WrittenGrainsAreReadBackBitForBit) {
  Sample sample;
  sample.density = 1;
  sample.id = {BodyId{7}, BodyId{3}};
  sample.x = {Vec3(0.1, 1.0 / 3, -2e-17), Vec3(1e5, 0, 0.7)};
  sample.radius = {0.011780518345951422, 0.5};
  const std::string path = write("");
  write_bodies(path, sample);
  const Sample resting = read_bodies(path, 1);
  EXPECT_EQ(resting.id, sample.id);
  EXPECT_EQ(resting.x, sample.x);
  EXPECT_EQ(resting.radius, sample.radius);
  EXPECT_TRUE(resting.velocity.empty());
  sample.velocity = {{1.0 / 7, 0, -3, 0, 0.25, 1e-9}, {0, 0, 0, 0, 0, 2}};
  write_bodies(path, sample);
  const Sample moving = read_bodies(path, 1);
  for (std::size_t k = 0; k < 2; ++k)
    for (std::size_t i = 0; i < 6; ++i)
      EXPECT_DOUBLE_EQ(moving.velocity[k][i], sample.velocity[k][i]) << k << i;  // spins are divided by radii
}

TEST(Csv, MissingFileIsNamed) {
  EXPECT_THROW(read_bodies("no/such/file.csv", 1), SceneError);
}

}  // namespace
}  // namespace talus::io
