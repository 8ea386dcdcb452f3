#include "io/scene/detail/foreign_words.hpp"

#include <algorithm>
#include <cctype>
#include <initializer_list>
#include <string_view>

namespace talus::io::detail {

namespace {

/// Words in small letters without lines between them.
struct ForeignWords {
  std::initializer_list<std::string_view> words;
  std::string_view hint;
};

const ForeignWords foreign_words[] = {
    {{"rollingfriction", "rollingfrictioncoefficient", "murolling", "frictionrolling", "mur"},
     "here it is `rolling_resistance`"},
    {{"mu", "frictioncoefficient", "coefficientoffriction", "slidingfriction", "mus"},
     "here it is `friction`"},
    {{"cor", "coefficientofrestitution", "restitutioncoefficient", "en"}, "here it is `restitution`"},
    {{"rho"}, "here it is `density`"},
    {{"diameter", "d50"}, "here sizes are radii: `radius`, `radius_min` and `radius_max`"},
    {{"young", "youngsmodulus", "youngmodulus", "emodulus", "poisson", "poissonratio", "poissonsratio",
      "shearmodulus", "stiffness", "normalstiffness", "tangentialstiffness", "kn", "kt", "damping",
      "normaldamping", "gamman", "gammat", "contactmodel", "hertz"},
     "there is none: grains are rigid and impulses hold them apart, so that no stiffness or damping is "
     "needed "
     "(docs/theory.md)"},
    {{"mesh", "stl", "stlfile", "geometry"},
     "a wall of triangles is a [[wall]] with shape = \"mesh\" and file = \"name.stl\""},
    {{"dt", "timestep", "deltat", "timestepsize"}, "here it is `time_step`"},
    {{"periodic", "boundary", "boundaries", "periodicity"}, "periodic space is a [cell]"},
    {{"ranks", "np", "nprocs", "processes", "mpi", "procs", "nranks"},
     "ranks are those of MPI: `mpirun -n 4 talus run SCENE`; subdomains are `decomposition.subdomains`"},
    {{"nthreads", "threads", "ompnumthreads", "numthreads"},
     "threads are an option: `talus run --threads 4`"},
    {{"nsteps", "maxsteps", "numsteps"},
     "the number of steps ends a stage, `end = { steps = 100 }`, or a run, `talus run --steps 100`"},
    {{"tend", "tmax", "endtime", "totaltime", "simulationtime"},
     "a time ends a stage: `end = { time = 1.0 }`"},
    {{"gpu", "cuda", "device"}, "there is none: Talus runs on processors"},
};

}  // namespace

std::string foreign_hint(const std::string& word) {
  std::string plain;
  for (const char c : word)
    if (std::isalnum(static_cast<unsigned char>(c)))
      plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  for (const ForeignWords& each : foreign_words)
    if (std::ranges::find(each.words, plain) != each.words.end()) return "; " + std::string(each.hint);
  return "";
}

}  // namespace talus::io::detail
