"""What colcon installs; the facts are those of package.xml."""

from pathlib import Path
from xml.etree import ElementTree

from setuptools import setup

facts = ElementTree.parse(Path(__file__).with_name("package.xml")).getroot()
name, maintainer = facts.findtext("name"), facts.find("maintainer")

setup(
    name=name,
    version=facts.findtext("version"),
    description=facts.findtext("description"),
    maintainer=maintainer.text,
    maintainer_email=maintainer.get("email"),
    license=facts.findtext("license"),
    packages=[name],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{name}"]),
        (f"share/{name}", ["package.xml"]),
        (f"share/{name}/launch", ["launch/skeletonize.launch.py"]),
    ],
    install_requires=["setuptools"],  # not glsk-o3d: colcon installs nothing from PyPI, and scripts must start without
    zip_safe=True,
    entry_points={"console_scripts": ["skeletonize_node = glsk_o3d_ros.node:main"]},
)
