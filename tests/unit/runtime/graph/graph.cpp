#include "runtime/graph/graph.hpp"

#include <gtest/gtest.h>

#include <random>
#include <stdexcept>
#include <string>
#include <vector>

namespace talus::graph {
namespace {

std::vector<std::uint32_t> predecessors(const Graph& graph, TaskId task) {
  std::vector<std::uint32_t> ids;
  for (const TaskId before : graph.predecessors(task)) ids.push_back(static_cast<std::uint32_t>(before));
  return ids;
}

using Ids = std::vector<std::uint32_t>;

TEST(Graph, ReadersWaitForTheLastWriterOnly) {
  Graph graph;
  const Handle a = graph.data("a");
  graph.task("first", {write(a)}, [] {});
  graph.task("second", {write(a)}, [] {});
  const TaskId one = graph.task("one reader", {read(a)}, [] {});
  const TaskId other = graph.task("another reader", {read(a)}, [] {});
  EXPECT_EQ(predecessors(graph, one), Ids{1});
  EXPECT_EQ(predecessors(graph, other), Ids{1});
  validate(graph);
}

TEST(Graph, AWriterWaitsForTheReadersSinceTheLastWriter) {
  Graph graph;
  const Handle a = graph.data("a");
  graph.task("early reader", {read(a)}, [] {});
  const TaskId first = graph.task("first writer", {write(a)}, [] {});
  graph.task("reader", {read(a)}, [] {});
  const TaskId second = graph.task("second writer", {write(a)}, [] {});
  EXPECT_EQ(predecessors(graph, first), Ids{0});
  EXPECT_EQ(predecessors(graph, second), (Ids{1, 2}));
  validate(graph);
}

TEST(Graph, TasksWithoutCommonDataAreIndependent) {
  Graph graph;
  const Handles parts = graph.data("parts", 3);
  for (std::uint32_t i = 0; i < 3; ++i)
    EXPECT_EQ(predecessors(graph, graph.task("part", {write(parts[i])}, [] {})), Ids{});
  EXPECT_EQ(predecessors(graph, graph.team("all", {read(parts)}, [](Worker&) {})), (Ids{0, 1, 2}));
  EXPECT_EQ(graph.edge_count(), 3U);
}

TEST(Graph, ReadingAndWritingTheSameDataIsWriting) {
  Graph graph;
  const Handle a = graph.data("a");
  const Handle b = graph.data("b");
  graph.task("both", {read(a), write(a), read(a), write(b)}, [] {});
  const TaskId next = graph.task("next", {write(a), read(a), read(b)}, [] {});
  EXPECT_EQ(predecessors(graph, next), Ids{0}) << "one edge, however many pieces of data carry it";
  const TaskId last = graph.task("last", {read(a)}, [] {});
  EXPECT_EQ(predecessors(graph, last), Ids{1});
}

TEST(Graph, NamesPartsByTheirPlace) {
  Graph graph;
  graph.data("empty", 0);
  const Handle a = graph.data("poses");
  const Handles cells = graph.data("cells", 4);
  EXPECT_EQ(graph.name(a), "poses");
  EXPECT_EQ(graph.name(cells[0]), "cells[0]");
  EXPECT_EQ(graph.name(cells[3]), "cells[3]");
}

TEST(Graph, RefusesDataOfAnotherGraph) {
  Graph graph;
  const Handles parts = graph.data("parts", 3);
  try {
    graph.task("sort", {read(parts[3])}, [] {});
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("'sort'"), std::string::npos) << error.what();
  }
  EXPECT_EQ(graph.size(), 0U) << "a refused task leaves nothing behind";
  EXPECT_THROW(graph.task("idle", {}, {}), std::invalid_argument);
}

TEST(Graph, ForgetsEverythingWhenCleared) {
  Graph graph;
  const Handle old = graph.data("old");
  graph.task("writer", {write(old)}, [] {});
  graph.clear();
  EXPECT_EQ(graph.size(), 0U);
  EXPECT_THROW(graph.task("stale", {read(old)}, [] {}), std::invalid_argument);
  const Handle fresh = graph.data("fresh");
  EXPECT_EQ(predecessors(graph, graph.task("reader", {read(fresh)}, [] {})), Ids{});
}

/// Against brute force: two tasks that touch the same data, one of them writing, must be ordered by a path of
/// edges.
TEST(Graph, OrdersEveryPairThatConflictsInRandomPrograms) {
  std::mt19937 random(7);
  for (int round = 0; round < 50; ++round) {
    Graph graph;
    const Handles data = graph.data("data", 6);
    std::vector<std::vector<Access>> all;
    for (int i = 0; i < 40; ++i) {
      std::vector<Access> accesses;
      for (auto k = random() % 4; k-- > 0;) {
        const Handle h = data[static_cast<std::uint32_t>(random() % 6)];
        accesses.push_back(random() % 3 == 0 ? write(h) : read(h));
      }
      graph.task("task", accesses, [] {});
      all.push_back(accesses);
    }
    validate(graph);
    // reaches[i][j]: there is a path from j to i.
    std::vector<std::vector<bool>> reaches(all.size(), std::vector<bool>(all.size(), false));
    for (std::uint32_t i = 0; i < all.size(); ++i)
      for (const std::uint32_t p : predecessors(graph, TaskId{i})) {
        reaches[i][p] = true;
        for (std::uint32_t j = 0; j < p; ++j)
          if (reaches[p][j]) reaches[i][j] = true;
      }
    for (std::size_t i = 0; i < all.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        for (const Access& late : all[i])
          for (const Access& early : all[j])
            if (late.handles.first == early.handles.first && (late.writes || early.writes)) {
              EXPECT_TRUE(reaches[i][j]) << j << " before " << i;
            }
  }
}

}  // namespace
}  // namespace talus::graph
