"""Pages of the manual for error messages."""

from __future__ import annotations

from itertools import chain
from traceback import walk_tb

PAGES = {
    "osimlite.errors.MissingDependency": "README.md#what-to-install",
    "osimlite.errors.MissingFileError": "docs/errors.md#files",
    "osimlite.errors.MissingFolderError": "docs/errors.md#folders",
    "osimlite.errors.NotWellFormedError": "docs/rules.md#text",
    "osimlite.errors.VersionError": "docs/errors.md#versions",
    "osimlite.derivatives": "docs/casadi.md",
    "osimlite.cli._validating": "docs/lint-in-ci.md",
    "osimlite.cli.build": "docs/errors.md#models-from-python-yaml-and-json",
    "osimlite.cli.check_trial": "docs/checking-trials.md",
    "osimlite.cli._converting": "docs/converting.md",
    "osimlite.cli.convert": "docs/converting.md",
    "osimlite.cli.demo": "README.md#start",
    "osimlite.cli.diff": "docs/format-and-diff.md",
    "osimlite.cli.doctor": "README.md#what-to-install",
    "osimlite.cli.find_gait": "docs/gaits.md#find-a-gait",
    "osimlite.cli.format": "docs/format-and-diff.md",
    "osimlite.cli.gait": "docs/gaits.md",
    "osimlite.cli.ik": "docs/fitting.md#inverse-kinematics",
    "osimlite.cli.info": "docs/format-and-diff.md#tables-setup-files-and-other-documents",
    "osimlite.cli.inverse_dynamics": "docs/from-opensim.md#kinematics-and-dynamics",
    "osimlite.cli.kinematics": "docs/from-opensim.md#kinematics-and-dynamics",
    "osimlite.cli.lsp": "docs/editors.md",
    "osimlite.cli.modify": "docs/modifying.md",
    "osimlite.cli.muscles": "docs/muscles.md",
    "osimlite.cli.optimize": "docs/sweeps.md#run-a-search",
    "osimlite.cli.rule": "docs/rules.md",
    "osimlite.cli.run": "docs/running-tools.md",
    "osimlite.cli.scone": "docs/reflexes.md",
    "osimlite.cli.scale": "docs/fitting.md#scaling",
    "osimlite.cli.fit": "docs/fitting.md#fit-a-model-to-a-person",
    "osimlite.cli.simulate": "docs/simulating.md",
    "osimlite.cli.static_optimization": "docs/running-tools.md#muscle-forces",
    "osimlite.cli.sweep": "docs/sweeps.md#run-a-sweep",
    "osimlite.cli.translate": "docs/converting.md",
    "osimlite.cli.upgrade": "docs/errors.md#versions",
    "osimlite.cli.validate": "docs/lint-in-ci.md",
    "osimlite.cli.view": "docs/viewer.md",
    "osimlite.mechanics.codegen": "docs/compiled.md",
    "osimlite.io.b3d": "docs/addbiomechanics.md",
    "osimlite.io.bvh": "docs/animation.md",
    "osimlite.io.document": "docs/rules.md#text",
    "osimlite.io.document.reader": "docs/errors.md#files",
    "osimlite.io.document.data": "docs/yaml.md",
    "osimlite.io.document.plugins": "docs/plugin-classes.md",
    "osimlite.base.files": "docs/errors.md#files",
    "osimlite.fitting": "docs/fitting.md",
    "osimlite.studies.gait": "docs/gaits.md",
    "osimlite.studies.gym": "docs/environments.md",
    "osimlite.lint": "docs/lint-in-ci.md",
    "osimlite.lint.config": "docs/lint-in-ci.md#settings",
    "osimlite.lint.settings": "docs/lint-in-ci.md#settings",
    "osimlite.cli.language_server": "docs/editors.md",
    "osimlite.lint.measuring": "docs/lint-in-ci.md#paths-and-muscles",
    "osimlite.io.meshes": "docs/viewer.md#meshes",
    "osimlite.models.source": "docs/errors.md#models-from-python-yaml-and-json",
    "osimlite.fitting.modifying": "docs/modifying.md",
    "osimlite.mechanics.multibody": "docs/constraints.md#models-that-are-rejected",
    "osimlite.mechanics.multibody.assembly": "docs/constraints.md#assemble-the-initial-state",
    "osimlite.mechanics.multibody.mechanism": "docs/from-opensim.md#kinematics-and-dynamics",
    "osimlite.mechanics.multibody.structure": "docs/from-opensim.md#kinematics-and-dynamics",
    "osimlite.base.reading": "docs/errors.md#files",
    "osimlite.studies.reflexes": "docs/reflexes.md",
    "osimlite.optimal": "docs/optimal-control.md",
    "osimlite.base.project": "docs/lint-in-ci.md#settings",
    "osimlite.schema": "docs/from-opensim.md#make-components",
    "osimlite.schema.tree": "docs/from-opensim.md#find-components",
    "osimlite.simulation": "docs/simulating.md",
    "osimlite.simulation.elements": "docs/forces.md#supported-forces",
    "osimlite.simulation.elements.control_sets": "docs/controls.md#controllers-of-the-model",
    "osimlite.simulation.elements.control_tables": "docs/controls.md#controllers-of-the-model",
    "osimlite.simulation.elements.controllers": "docs/controls.md#controllers-of-the-model",
    "osimlite.simulation.elements.external_loads": "docs/forces.md#measured-loads",
    "osimlite.simulation.elements.foundation": "docs/forces.md#contact-meshes",
    "osimlite.simulation.elements.geometries.paths": "docs/forces.md#paths",
    "osimlite.simulation.elements.muscle": "docs/forces.md#muscles",
    "osimlite.simulation.elements.probe_type": "docs/controls.md#probes",
    "osimlite.simulation.elements.synergies": "docs/controls.md#controllers-of-the-model",
    "osimlite.simulation.elements.triangle_mesh": "docs/forces.md#contact-meshes",
    "osimlite.simulation.engines": "docs/compiled.md",
    "osimlite.io.tables": "docs/forces.md#tables",
    "osimlite.simulation.run_controls": "docs/controls.md#set-controls",
    "osimlite.simulation.options": "docs/simulating.md",
    "osimlite.simulation.options.check_integrator": "docs/integrators.md",
    "osimlite.simulation.static_optimization": "docs/running-tools.md#muscle-forces",
    "osimlite.simulation.muscle_curves": "docs/muscles.md",
    "osimlite.simulation.paths": "docs/forces.md#paths",
    "osimlite.studies.sweep": "docs/sweeps.md",
    "osimlite.studies.sweep.controls": "docs/sweeps.md#vary-controls-over-time",
    "osimlite.studies.sweep.expressions": "docs/sweeps.md#measures-and-expressions",
    "osimlite.studies.sweep.measures": "docs/sweeps.md#measures-and-expressions",
    "osimlite.studies.sweep.optimize": "docs/sweeps.md#run-a-search",
    "osimlite.base.pools": "docs/sweeps.md#use-a-cluster",
    "osimlite.simulation.properties": "docs/sweeps.md#variables",
    "osimlite.studies.sweep.results": "docs/sweeps.md#resume-an-interrupted-sweep",
    "osimlite.studies.sweep.run": "docs/sweeps.md#resume-an-interrupted-sweep",
    "osimlite.studies.sweep.sampling": "docs/sweeps.md#sampling-methods",
    "osimlite.studies.sweep.variables": "docs/sweeps.md#variables",
    "osimlite.tools": "docs/running-tools.md",
    "osimlite.tools.trials": "docs/checking-trials.md",
    "osimlite.translate": "docs/converting.md",
    "osimlite.translate.export": "docs/urdf.md",
    "osimlite.translate.sidecar": "docs/urdf.md",
    "osimlite.translate.function_data": "docs/urdf.md",
    "osimlite.translate.collisions": "docs/urdf.md",
    "osimlite.translate.addbiomechanics": "docs/addbiomechanics.md",
    "osimlite.translate.biomod": "docs/biorbd.md",
    "osimlite.translate.bvh": "docs/animation.md",
    "osimlite.translate.mjcf": "docs/mujoco.md",
    "osimlite.translate.mjcf_import": "docs/from-mjcf.md",
    "osimlite.translate.nimble": "docs/addbiomechanics.md#models-made-for-nimblephysics",
    "osimlite.view": "docs/viewer.md",
    "osimlite.base.result_writing": "docs/running-tools.md#input-and-output-files",
    "osimlite.base.writing": "docs/errors.md#files",
}
"""Pages and headings by the class of an error, otherwise by the function, module or package that raised it.

Modules without a page are skipped for the one that called them.
"""


def find_page(error: BaseException) -> str:
    """Return the page of the manual for an exception that was raised."""
    class_names = (f"{cls.__module__}.{cls.__qualname__}" for cls in type(error).__mro__)
    functions = (
        f"{frame.f_globals.get('__name__', '')}.{frame.f_code.co_name}"
        # From the innermost frame outwards: the function that found the problem knows it best.
        for frame, _ in reversed([*walk_tb(error.__traceback__)])
    )
    for name in chain(class_names, functions):
        # A function without an entry belongs to the page of its module, a module to that of its
        # package.
        while name:
            if name in PAGES:
                return PAGES[name]
            name = name.rpartition(".")[0]
    return "docs/errors.md"
