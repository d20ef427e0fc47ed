"""Parameters of a scene: numbers with respect to which a run is differentiated, or that a fit changes."""

from msfp_gen.scene.parameters.change import changed_parameters
from msfp_gen.scene.parameters.parameter import Parameter
from msfp_gen.scene.parameters.paths import parameters_of

__all__ = ["Parameter", "changed_parameters", "parameters_of"]
