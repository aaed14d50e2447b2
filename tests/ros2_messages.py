"""Builds message packages, from their .msg files alone, into a prefix that ROS 2, rclpy and r2r can use.

The drivers' own message packages need colcon and their repositories; for tests it is enough that messages of the same
shape go over the wire. Packages that the sourced ROS 2 has are left as they are. Needs a C and a C++ compiler.
"""

import argparse
import os
import shutil
import subprocess
import sysconfig
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from rosidl_adapter.msg import convert_msg_to_idl
from rosidl_generator_c.cli import GenerateC
from rosidl_generator_py.cli import GeneratePython
from rosidl_typesupport_c.cli import GenerateCTypesupport
from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport
from rosidl_typesupport_introspection_c.cli import GenerateIntrospectionCTypesupport

# In the order in which they link each other. The one that chooses among the others at run time comes after them.
LIBRARIES = {
    "rosidl_generator_c": GenerateC,
    "rosidl_typesupport_introspection_c": GenerateIntrospectionCTypesupport,
    "rosidl_typesupport_fastrtps_c": GenerateFastRTPSCTypesupport,
    "rosidl_typesupport_c": GenerateCTypesupport,
    "rosidl_generator_py": GeneratePython,
}
# What generated code calls.
RUNTIME = [
    "fastcdr",
    "rcutils",
    "rosidl_runtime_c",
    "rosidl_typesupport_c",
    "rosidl_typesupport_fastrtps_c",
    "rosidl_typesupport_fastrtps_cpp",
    "rosidl_typesupport_introspection_c",
]


class Package:
    """One message package on its way from .msg files to libraries."""

    def __init__(self, folder, prefix, sourced, build):
        self.folder, self.name = folder, folder.name
        self.prefix, self.sourced, self.build = prefix, sourced, build
        self.share = prefix / "share" / self.name

    def generate(self):
        """Writes the sources of all libraries, and the .msg and .idl files that others look for."""
        messages = sorted((self.folder / "msg").glob("*.msg"))
        (self.share / "msg").mkdir(parents=True)
        for message in messages:
            shutil.copy(message, self.share / "msg")
            convert_msg_to_idl(self.folder, self.name, message.relative_to(self.folder), self.share / "msg")
        names = [f"msg/{message.stem}.idl" for message in messages]
        shares = [str(prefix / "share") for prefix in [self.prefix, *self.sourced]]
        for library, generator in LIBRARIES.items():
            out = self.build / library / self.name
            out.mkdir(parents=True)
            generator(library).generate(self.name, [f"{self.share}:{name}" for name in names], shares, out)
        index = self.prefix / "share" / "ament_index" / "resource_index"
        for resource, content in {"rosidl_interfaces": "\n".join(names), "packages": ""}.items():
            (index / resource).mkdir(parents=True, exist_ok=True)
            (index / resource / self.name).write_text(content)
        headers = self.prefix / "include" / self.name / self.name
        for library in LIBRARIES:
            out = self.build / library / self.name
            for header in out.rglob("*.h"):
                target = headers / header.relative_to(out)
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(header, target)

    def compile(self):
        """Compiles and links the libraries, and the module that rclpy loads."""
        (self.prefix / "lib").mkdir(exist_ok=True)
        linked = []
        for library in LIBRARIES:
            sources = self.build / library / self.name / "msg"
            found = sorted([*sources.rglob("*.c"), *sources.rglob("*.cpp")])
            self.link(self.prefix / "lib" / f"lib{self.name}__{library}.so", found, linked)
            linked.append(f"{self.name}__{library}")
        python = self.build / "rosidl_generator_py" / self.name
        modules = self.prefix / "lib" / "python" / self.name
        shutil.copytree(python / "msg", modules / "msg", ignore=shutil.ignore_patterns("*.c"))
        (modules / "__init__.py").touch()
        entry = python / f"_{self.name}_s.ep.rosidl_typesupport_c.c"
        self.link(modules / f"{self.name}_s__rosidl_typesupport_c.so", [entry], linked)

    def link(self, target, sources, libraries):
        prefixes = [self.prefix, *self.sourced]
        headers = [folder for prefix in prefixes for folder in [prefix / "include", *sorted(prefix.glob("include/*"))]]
        includes = [f"-I{folder}" for folder in headers]
        includes.append(f"-I{sysconfig.get_paths()['include']}")
        includes.append(f"-I{numpy_headers()}")
        folders = [f"-L{prefix / 'lib'}" for prefix in prefixes]
        needed = [f"-l{library}" for library in [*reversed(libraries), *RUNTIME, *self.nested()]]
        compiler = os.environ.get("CXX", "c++")
        objects = [self.compile_one(source, target.stem, includes) for source in sources]
        options = ["-shared", "-Wl,--as-needed", "-Wl,-rpath,$ORIGIN"]
        run([compiler, *options, "-o", target, *objects, *folders, *needed])

    def compile_one(self, source, stem, includes):
        cc, cxx = os.environ.get("CC", "cc"), os.environ.get("CXX", "c++")
        compiler = cxx if source.suffix == ".cpp" else cc
        out = self.build / "objects" / self.name / stem / f"{source.name}.o"
        out.parent.mkdir(parents=True, exist_ok=True)
        run([compiler, "-c", "-fPIC", "-O1", "-w", *includes, source, "-o", out])
        return out

    def nested(self):
        """Libraries of the packages whose messages are nested in this one's."""
        texts = " ".join(message.read_text() for message in (self.folder / "msg").glob("*.msg"))
        packages = sorted({word.split("/")[0] for word in texts.split() if "/" in word} | {"builtin_interfaces"})
        return [f"{package}__{library}" for package in packages for library in LIBRARIES]


def numpy_headers():
    import numpy

    return numpy.get_include()


def run(command):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(map(str, command))}\n{done.stderr}")


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("sources", type=Path, help="folder with a folder a package")
    arguments.add_argument("prefix", type=Path, help="where to install; replaced")
    arguments = arguments.parse_args()
    sourced = [Path(prefix) for prefix in os.environ["AMENT_PREFIX_PATH"].split(":")]
    known = {path.name for prefix in sourced for path in prefix.glob("share/ament_index/resource_index/packages/*")}
    shutil.rmtree(arguments.prefix, ignore_errors=True)
    prefix = arguments.prefix.absolute()
    with tempfile.TemporaryDirectory() as build:
        folders = [folder.absolute() for folder in sorted(arguments.sources.iterdir()) if folder.name not in known]
        packages = [Package(folder, prefix, sourced, Path(build)) for folder in folders]
        for package in packages:
            package.generate()
        with ThreadPoolExecutor() as pool:
            list(pool.map(Package.compile, packages))


if __name__ == "__main__":
    main()
