#pragma once

/// What must hold of the groups of any chunk.

#include <gtest/gtest.h>

#include <set>
#include <vector>

#include "tests/unit/dense_sample.hpp"

namespace talus::test {

/// Sizes of the groups of a chunk; a failure when they do not cover its contacts, are empty or larger than
/// 16, or a grain stands in one twice.
inline std::vector<std::size_t> checked_groups(const Sample& sample, std::size_t chunk) {
  std::vector<std::size_t> sizes;
  const ContactRange range = sample.range(chunk);
  std::size_t k = range.begin;
  for (const std::uint8_t* size = &sample.contacts.group[range.begin]; k < range.end; k += *size++) {
    EXPECT_GE(*size, 1);
    EXPECT_LE(*size, 16);
    std::set<Slot> grains(&sample.contacts.first[k], &sample.contacts.first[k] + *size);
    const bool wall = sample.chunks.wall[chunk] >= 0;
    if (!wall) grains.insert(&sample.contacts.second[k], &sample.contacts.second[k] + *size);
    EXPECT_EQ(grains.size(), (wall ? 1u : 2u) * *size) << "chunk " << chunk;
    if (*size == 0) break;
    sizes.push_back(*size);
  }
  EXPECT_EQ(k, range.end) << "groups cover the contacts of chunk " << chunk;
  return sizes;
}

}  // namespace talus::test
