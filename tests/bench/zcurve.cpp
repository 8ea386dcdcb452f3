/// Time to an error, by method: one step of a packing of spheres that begins cold. The baseline is plain NLGS
/// with the scalar kernel, in the same program.
///
///   bench_solvers SPHERES.csv [SUBDOMAINS...]
///
/// SPHERES.csv as for bench_coupling. Checks of the error are part of the time. Medians of three runs that
/// alternate.

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "runtime/step/simulation.hpp"
#include "tests/bench/packed_scene.hpp"

namespace {

using namespace talus;

}
int main(int argc,char**argv){
 const bench::Packing packing = bench::read_packing(argv[1]);
 const bool pile=std::stoi(argv[2]); const double mu=std::stod(argv[3]), tol=std::stod(argv[4]);
 const std::string m=argv[5]; int sub=std::stoi(argv[6]); int mx=std::stoi(argv[7]); int every=argc>8?std::stoi(argv[8]):7; std::string part=argc>9?argv[9]:"boxes";
 Setup setup = bench::packed_scene(packing, pile, tol, mu);
 setup.solver.method = m=="nncg"?SolverMethod::nncg:m=="momentum"?SolverMethod::momentum:m=="nlgs"?SolverMethod::nlgs:SolverMethod::automatic;
 setup.solver.balance_tolerance=1e9; setup.solver.max_iterations=mx; setup.decomposition.subdomains=sub;setup.solver.check_every=every==7?10:every;
 setup.decomposition.partitioner = part=="metis"?PartitionKind::metis:part=="rcb"?PartitionKind::rcb:part=="fitted"?PartitionKind::fitted:PartitionKind::boxes;
 graph::Executor executor({.threads = 1});
 Simulation simulation(setup, packing.bodies, executor);
 simulation.step();
 for (auto&c: simulation.error_history()) fmt::print("{} {:.4e} {:.5f}\n",c.iterations,c.error_rms,c.seconds);
}
