/// Pictures of grains by speed and by material.

#include <gtest/gtest.h>

#include <array>
#include <string>

#include "io/pictures/detail/slab.hpp"
#include "io/pictures/picture.hpp"

namespace talus::io::grain_picture_test {
namespace {

Frame grains() {
  Frame frame;
  frame.stage = "flow";
  for (int k = 0; k < 40; ++k) {
    frame.id.push_back(k);
    frame.x.push_back({0.1 * k, k < 30 ? 0.0 : 9.0, 0});
    frame.radius.push_back(0.01);
    frame.u.push_back({0, 0, k < 10 ? -1.0 : 0.0});
    frame.material.push_back(k % 3 == 0 ? 1 : 0);
  }
  frame.x.front().y() = -9;  // the slab is about y = 0
  return frame;
}

std::size_t occurrences(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++found;
  return found;
}

TEST(GrainPictures, TheFastAreDarkAndHaveALineAlongTheirVelocity) {
  const std::string svg = draw_velocities(grains(), {});
  // Ten of forty move; one of these is out of the slab.
  EXPECT_EQ(occurrences(svg, "<circle"), 29u);
  EXPECT_EQ(occurrences(svg, "#0a2c55"), 9u + 1u);  // the legend has each colour once
  EXPECT_EQ(occurrences(svg, "<line"), 9u + 1u);    // the scale is a line
  EXPECT_NE(svg.find("1 m/s and more"), std::string::npos);
}

TEST(GrainPictures, TheLegendOfMaterialsCountsTheGrainsThatAreSeen) {
  const std::array<std::string, 3> names{"glass", "steel", "none"};
  const std::string svg = draw_materials(grains(), names, {});
  EXPECT_NE(svg.find("glass (20)"), std::string::npos);
  EXPECT_NE(svg.find("steel (9)"), std::string::npos);
  EXPECT_EQ(svg.find("none ("), std::string::npos);
}

TEST(GrainPictures, AWallAboveAWideBedIsSeenAsFarAsHalfItsWidth) {
  // Grains from x = -0.01 to 2.01, 0.02 high; the wall at x = 0 goes on up to 0.9.
  Frame frame;
  for (int k = 0; k < 21; ++k) {
    frame.id.push_back(k);
    frame.x.push_back({0.1 * k, 0, 0});
    frame.radius.push_back(0.01);
  }
  const detail::Slab slab = detail::cut_slab(frame, 1);
  const std::vector<detail::Cut> low{{0, 0, 0, 0.9}}, high{{0, 0, 0, 9}};
  EXPECT_GT(detail::view_of(frame, slab, low, {100, 0, 0}).z_high, 0.9);
  EXPECT_NEAR(detail::view_of(frame, slab, high, {100, 0, 0}).z_high, 0.01 + 1.01 + 0.01, 1e-12);
}

TEST(GrainPictures, OfNothingAndOfGrainsAtRestArePictures) {
  Frame still = grains();
  for (Vec3& u : still.u) u.setZero();
  EXPECT_NE(draw_velocities(still, {}).find("at rest"), std::string::npos);
  EXPECT_EQ(draw_velocities({}, {}).find("nan"), std::string::npos);
  EXPECT_EQ(draw_materials({}, {}, {}).find("nan"), std::string::npos);
}

}  // namespace
}  // namespace talus::io::grain_picture_test
