# SPDX-License-Identifier: Apache-2.0
"""The engine as a package of Conan 2, made of the repository that this file lies in:

    conan create deploy/conan --build=missing -s compiler.cppstd=20

It has warmfront::engine and the plug for IPC Toolkit. The service is a Debian package, a wheel or an image (deploy/README.md)."""
import os
import re

from conan import ConanFile
from conan.errors import ConanInvalidConfiguration
from conan.tools.build import check_min_cppstd
from conan.tools.cmake import CMake, CMakeDeps, CMakeToolchain, cmake_layout
from conan.tools.files import copy, load, rmdir

required_conan_version = ">=2.0.9"
# Of the repository, what the engine is configured, built and installed of.
SOURCES = ("CMakeLists.txt", "LICENSE", "deploy/cmake/*", "engine/*", "client/ipc_toolkit/*")


class Warmfront(ConanFile):
    name = "warmfront"
    license = "Apache-2.0"
    description = "Incremental multi-core continuous collision detection"
    topics = ("collision-detection", "ccd", "simulation", "geometry")
    package_type = "static-library"
    settings = "os", "arch", "compiler", "build_type"

    @property
    def _repository(self):
        return os.path.join(self.recipe_folder, os.pardir, os.pardir)

    def set_version(self):
        project = load(self, os.path.join(self._repository, "CMakeLists.txt"))
        self.version = re.search(r"project\(warmfront VERSION (\S+)", project).group(1)

    def export_sources(self):
        for pattern in SOURCES:
            copy(self, pattern, self._repository, self.export_sources_folder)

    def layout(self):
        cmake_layout(self)

    def requirements(self):
        # The first is in the public header engine/eigen.h, the others in the library alone.
        self.requires("eigen/[>=3.4 <6]", transitive_headers=True)
        self.requires("onetbb/[>=2021.8]")
        self.requires("gmp/[>=6.2 <7]")

    def validate(self):
        check_min_cppstd(self, 20)
        if str(self.settings.os) != "Linux" or str(self.settings.compiler) not in ("gcc", "clang"):
            raise ConanInvalidConfiguration("warmfront is built and tested with GCC and Clang on Linux alone")

    def generate(self):
        toolchain = CMakeToolchain(self)
        toolchain.cache_variables["WARMFRONT_SERVICE"] = False
        toolchain.cache_variables["WARMFRONT_TESTS"] = False
        toolchain.generate()
        dependencies = CMakeDeps(self)
        # By the names and targets of the project's own find_package() calls.
        dependencies.set_property("gmp", "cmake_file_name", "GMP")
        dependencies.set_property("gmp::libgmp", "cmake_target_name", "GMP::gmp")
        dependencies.set_property("gmp", "cmake_find_mode", "both")
        dependencies.generate()

    def build(self):
        cmake = CMake(self)
        cmake.configure()
        cmake.build()

    def package(self):
        copy(self, "LICENSE", self.source_folder, os.path.join(self.package_folder, "licenses"))
        CMake(self).install()
        rmdir(self, os.path.join(self.package_folder, "lib", "cmake"))  # CMakeDeps writes what consumers find

    def package_info(self):
        self.cpp_info.set_property("cmake_file_name", "warmfront")
        engine = self.cpp_info.components["engine"]
        engine.set_property("cmake_target_name", "warmfront::engine")
        engine.includedirs = [os.path.join("include", "warmfront")]
        engine.libs = ["warmfront_engine"]
        engine.system_libs = ["pthread", "m"]
        engine.requires = ["eigen::eigen3", "onetbb::libtbb", "gmp::libgmp"]
