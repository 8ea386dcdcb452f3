# A recipe for Spack 1.0 and newer. It is built from a checkout:
#
#     spack repo create talus-recipes talus_recipes
#     mkdir -p talus-recipes/spack_repo/talus_recipes/packages/talus
#     cp apps/packages/spack/package.py talus-recipes/spack_repo/talus_recipes/packages/talus/
#     spack repo add talus-recipes/spack_repo/talus_recipes
#     spack dev-build --source-path . talus@main
#
# Spack 0.23 has the folder talus-recipes/packages/talus instead, and adds talus-recipes.
import os

from spack.package import *

try:
    from spack_repo.builtin.build_systems.cmake import CMakePackage, generator
except ImportError:  # before 1.0 spack.package has both
    pass


class Talus(CMakePackage):
    """Dense granular matter by nonsmooth contact dynamics, on MPI ranks and OpenMP threads."""

    license("Apache-2.0")

    version("main", branch="main")

    variant("python", default=False, description="What the Python package needs at run time")

    depends_on("c", type="build")
    depends_on("cxx", type="build")
    depends_on("cmake@3.25:", type="build")
    depends_on("mpi")
    depends_on("hdf5@1.10: +mpi")
    depends_on("eigen@3.4:")
    depends_on("metis@5:")
    depends_on("zlib-api")
    depends_on("fmt@9:")
    depends_on("nlohmann-json@3.11:")
    depends_on("tomlplusplus@3:")
    depends_on("cli11@2:")
    depends_on("random123")
    depends_on("python@3.11:", type="run", when="+python")
    depends_on("py-h5py", type="run", when="+python")
    depends_on("py-numpy", type="run", when="+python")
    depends_on("py-matplotlib", type="run", when="+python")
    depends_on("py-tomli-w", type="run", when="+python")

    conflicts("%gcc@:11", msg="C++20 as Talus uses it begins with gcc 12")

    generator("ninja")

    def cmake_args(self):
        return [self.define("TALUS_TESTS", False)]

    def setup_run_environment(self, env):
        if self.spec.satisfies("+python"):
            env.prepend_path("PYTHONPATH", join_path(self.prefix.lib, "python3", "dist-packages"))

    @run_after("install")
    @on_package_attributes(run_tests=True)
    def smoke(self):
        script = join_path(self.prefix.share, "talus", "smoke.sh")
        path = os.pathsep.join([self.prefix.bin, os.environ["PATH"]])
        which("bash")(script, extra_env={"PATH": path})
