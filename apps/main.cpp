#include <CLI/CLI.hpp>

#include "apps/solve.hpp"

int main(int argc, char** argv) {
  CLI::App app{"Talus"};
  talus::apps::SolveOptions options;
  CLI::App* solve = app.add_subcommand("solve", "Solve an FCLIB problem");
  solve->add_option("problem", options.path)->required();
  solve->add_option("--tol", options.tol);
  solve->add_option("--max-seconds", options.max_seconds);
  solve->add_option("--out", options.out);
  CLI11_PARSE(app, argc, argv);
  return *solve ? talus::apps::solve_command(options) : 0;
}
