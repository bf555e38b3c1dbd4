# SPDX-License-Identifier: Apache-2.0
"""The Conan recipe and the vcpkg port, run with stand-ins for what these tools give them: sources, options, installation and a
consumer are real, and the dependencies the system's. With Conan itself `conan create deploy/conan`, with vcpkg `vcpkg install
warmfront --overlay-ports=deploy/vcpkg`."""
import importlib.util
import json
import os
import re
import shutil
import sys
import types

import packages
import pytest
from packages import BUILD, SOURCE

PORT = SOURCE / "deploy" / "vcpkg" / "warmfront"
# What each of CMake's packages is called in Conan Center, and in vcpkg.
NAMES = {"Eigen3": ("eigen", "eigen3"), "TBB": ("onetbb", "tbb"), "GMP": ("gmp", "gmp")}

pytestmark = pytest.mark.skipif(not (BUILD / "engine" / "libwarmfront_engine.a").exists(), reason="the engine is not built")


@pytest.fixture(scope="module")
def engine_alone(tmp_path_factory):
    """What is installed of a build without the service."""
    folder = tmp_path_factory.mktemp("engine-alone")
    packages.configure(SOURCE, folder / "build", "-DWARMFRONT_SERVICE=OFF", "-DWARMFRONT_TESTS=OFF")
    packages.install(folder / "build", folder / "installed")
    return folder / "installed"


@pytest.fixture(scope="module")
def everything(tmp_path_factory):
    """What the build at hand installs, with the service."""
    folder = tmp_path_factory.mktemp("everything")
    packages.install(BUILD, folder)
    return folder


def test_what_cmake_installs_without_the_service(engine_alone, tmp_path):
    packages.consume(engine_alone, engine_alone.parent / "consumer")
    assert packages.found(engine_alone, tmp_path, "engine") == "found\n"
    assert "component client: this build of warmfront has no service" in packages.found(engine_alone, tmp_path, "client")
    assert "there is no component motor: there are engine and client" in packages.found(engine_alone, tmp_path, "motor")


@pytest.mark.skipif(not (BUILD / "bin" / "warmfrontd").exists(), reason="the service is not built")
def test_who_wants_the_engine_alone_needs_no_grpc(everything, tmp_path):
    without = ("-DCMAKE_DISABLE_FIND_PACKAGE_gRPC=ON", "-DCMAKE_DISABLE_FIND_PACKAGE_Protobuf=ON")
    assert packages.found(everything, tmp_path, "engine", *without) == "found\n"
    assert "dependency Protobuf could not be found" in packages.found(everything, tmp_path, "client", *without)
    assert packages.found(everything, tmp_path, "client") == "found\n"


@pytest.mark.skipif(not (BUILD / "bin" / "warmfrontd").exists(), reason="the service is not built")
def test_a_client_that_was_not_asked_for_is_not_there_and_said_not_to_be(everything, tmp_path):
    def links_client(components):
        return packages.linked(everything, tmp_path, components, "warmfront::client")
    told = links_client("engine")
    assert "The component client was not asked for, so there is no warmfront::client" in told
    assert "but the target was not found" in told and "gRPC" not in told and "warmfrontTargets" not in told, told
    for components in ("engine client", "client"):
        told = links_client(components)
        assert "Generating done" in told and "not asked for" not in told, told
    assert "Generating done" in packages.linked(everything, tmp_path, "engine", "warmfront::engine")


# --- Conan ---

def copy(_, pattern, source, target):
    """As conan.tools.files.copy(): of a pattern, * is any part of a path."""
    expression = re.compile(re.escape(pattern).replace(r"\*", ".*"))
    for folder, _, names in os.walk(source):
        if os.path.relpath(folder, source).split(os.sep)[0] in (".git", "build"):
            continue
        for name in names:
            path = os.path.relpath(os.path.join(folder, name), source)
            if expression.fullmatch(path):
                os.makedirs(os.path.dirname(os.path.join(target, path)), exist_ok=True)
                shutil.copy2(os.path.join(source, path), os.path.join(target, path))


class Recorded:
    """A generator, or CMake: what a recipe tells it."""
    made = []

    def __init__(self, recipe):
        self.cache_variables, self.properties, self.calls = {}, [], []
        Recorded.made.append(self)

    def set_property(self, *property_):
        self.properties.append(property_)

    def generate(self):
        self.calls.append("generate")

    configure = build = install = generate


class Component:
    def __init__(self):
        self.properties = {}

    def set_property(self, name, value):
        self.properties[name] = value


class CppInfo(Component):
    def __init__(self):
        super().__init__()
        self.components = {"engine": Component()}


class InvalidConfiguration(Exception):
    pass


@pytest.fixture
def recipe(monkeypatch):
    """An object of the recipe's class, with stand-ins for the modules that it imports."""
    Recorded.made = []
    standards = []
    modules = {
        "conan": {"ConanFile": object},
        "conan.errors": {"ConanInvalidConfiguration": InvalidConfiguration},
        "conan.tools": {},
        "conan.tools.build": {"check_min_cppstd": lambda recipe, least: standards.append(least)},
        "conan.tools.cmake": {"CMake": Recorded, "CMakeDeps": Recorded, "CMakeToolchain": Recorded, "cmake_layout": lambda recipe: None},
        "conan.tools.files": {"copy": copy, "load": lambda recipe, path: open(path).read(),
                              "rmdir": lambda recipe, path: shutil.rmtree(path, ignore_errors=True)},
    }
    for name, content in modules.items():
        module = types.ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
    spec = importlib.util.spec_from_file_location("recipe_of_warmfront", SOURCE / "deploy" / "conan" / "conanfile.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    made = module.Warmfront()
    made.recipe_folder = str(SOURCE / "deploy" / "conan")
    made.required = {}
    made.requires = lambda reference, **traits: made.required.update([reference.split("/", 1)])
    made.settings = types.SimpleNamespace(os="Linux", compiler="gcc")
    made.cpp_info = CppInfo()
    made.standards = standards
    return made


def test_conan_recipe_builds_of_what_it_exports(recipe, tmp_path):
    recipe.export_sources_folder = recipe.source_folder = str(tmp_path / "exported")
    recipe.export_sources()
    recipe.generate()
    toolchain = Recorded.made[0]
    options = [f"-D{name}={'ON' if value else 'OFF'}" for name, value in toolchain.cache_variables.items()]
    assert options
    packages.configure(tmp_path / "exported", tmp_path / "build", *options)
    packages.install(tmp_path / "build", tmp_path / "installed")
    packages.consume(tmp_path / "installed", tmp_path / "consumer")
    sources = {path.relative_to(SOURCE) for path in (SOURCE / "engine").rglob("*.cpp")}
    assert sources == {path.relative_to(tmp_path / "exported") for path in (tmp_path / "exported").rglob("*.cpp")}
    recipe.package_folder = str(tmp_path / "installed")
    recipe.package()
    assert (tmp_path / "installed" / "licenses" / "LICENSE").read_bytes() == (SOURCE / "LICENSE").read_bytes()


def test_conan_recipe_says_what_there_is(recipe, engine_alone):
    recipe.set_version()
    assert (recipe.name, recipe.version) == ("warmfront", packages.version())
    recipe.requirements()
    assert set(recipe.required) == {NAMES[name][0] for name in packages.needed_by_engine()}
    recipe.package_info()
    engine = recipe.cpp_info.components["engine"]
    assert engine.properties["cmake_target_name"] == "warmfront::engine"
    assert {name.split("::")[0] for name in engine.requires} == set(recipe.required)
    for name in engine.libs:
        assert (engine_alone / "lib" / f"lib{name}.a").exists()
    for folder in engine.includedirs:
        assert (engine_alone / folder / "engine" / "collider.h").exists()


def test_conan_recipe_refuses_what_is_not_tested(recipe):
    recipe.validate()
    assert recipe.standards == [20]
    for system, compiler in (("Windows", "gcc"), ("Linux", "msvc")):
        recipe.settings = types.SimpleNamespace(os=system, compiler=compiler)
        with pytest.raises(InvalidConfiguration):
            recipe.validate()


# --- vcpkg ---

# The functions of vcpkg that the port calls, as far as it uses them. Of the two that build, the second installs the library at hand.
VCPKG = """
set(PORT warmfront)
set(CURRENT_PACKAGES_DIR {packages})
function(vcpkg_check_linkage)
endfunction()
function(vcpkg_cmake_configure)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "SOURCE_PATH" "OPTIONS")
  execute_process(COMMAND cmake -G Ninja -S ${{arg_SOURCE_PATH}} -B {build} -DCMAKE_BUILD_TYPE=Release ${{arg_OPTIONS}}
                  COMMAND_ERROR_IS_FATAL ANY OUTPUT_QUIET)
endfunction()
function(vcpkg_cmake_install)
  file(COPY {library} DESTINATION {build}/engine)
  execute_process(COMMAND cmake --install {build} --prefix ${{CURRENT_PACKAGES_DIR}} COMMAND_ERROR_IS_FATAL ANY OUTPUT_QUIET)
endfunction()
function(vcpkg_cmake_config_fixup)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "CONFIG_PATH" "")
  # It moves the folder to share/PORT and corrects the paths in it: here it has to be there.
  if(NOT EXISTS ${{CURRENT_PACKAGES_DIR}}/${{arg_CONFIG_PATH}}/${{PORT}}Config.cmake)
    message(FATAL_ERROR "vcpkg_cmake_config_fixup: no package config in ${{arg_CONFIG_PATH}}")
  endif()
endfunction()
function(vcpkg_install_copyright)
  cmake_parse_arguments(PARSE_ARGV 0 arg "" "" "FILE_LIST")
  file(INSTALL ${{arg_FILE_LIST}} DESTINATION ${{CURRENT_PACKAGES_DIR}}/share/${{PORT}} RENAME copyright)
endfunction()
include({port}/portfile.cmake)
"""


def test_vcpkg_port_builds_and_installs(tmp_path):
    installed = tmp_path / "installed"
    script = tmp_path / "script.cmake"
    packages.know_compiler(tmp_path / "build")
    script.write_text(VCPKG.format(packages=installed, build=tmp_path / "build", port=PORT,
                                   library=BUILD / "engine" / "libwarmfront_engine.a"))
    packages.run("cmake", "-P", script)
    packages.consume(installed, tmp_path / "consumer")
    assert (installed / "share" / "warmfront" / "copyright").read_bytes() == (SOURCE / "LICENSE").read_bytes()
    assert (installed / "share" / "warmfront" / "usage").exists()
    used = (PORT / "usage").read_text()
    consumer = (packages.CONSUMER / "CMakeLists.txt").read_text()
    for line in re.findall(r"^  (\w+\(.*)$", used, re.MULTILINE):
        assert line.replace("main", "consumer") in consumer


def test_vcpkg_manifest(tmp_path):
    text = (PORT / "vcpkg.json").read_text()
    manifest = json.loads(text)
    assert text == json.dumps(manifest, indent=2) + "\n", "as vcpkg format-manifest writes it"
    assert (manifest["name"], manifest["version"], manifest["license"]) == ("warmfront", packages.version(), "Apache-2.0")
    names = [each if isinstance(each, str) else each["name"] for each in manifest["dependencies"]]
    tools = {each["name"] for each in manifest["dependencies"] if not isinstance(each, str) and each.get("host")}
    assert names == sorted(names) and tools == {"vcpkg-cmake", "vcpkg-cmake-config"}
    assert set(names) - tools == {NAMES[name][1] for name in packages.needed_by_engine()}
