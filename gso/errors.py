"""The package's exceptions.

Every exception that the package raises on purpose is a :class:`GSOError`. Its message names the
vertex, face, file or option and says what to do about it.
"""


class GSOError(Exception):
    """Base class of the package's errors."""


class MeshError(GSOError, ValueError):
    """Input geometry or a mesh file cannot be used."""


class NonManifoldError(MeshError):
    """Parts share only a vertex, an edge has more than two faces, or the surface is one-sided."""


class OptionError(GSOError, ValueError):
    """An option, a constraint or a task name is unknown or contradictory."""


class BackendError(GSOError, RuntimeError):
    """A linear-algebra backend is not installed or failed."""


class WeightsError(GSOError, ValueError):
    """A weight file is corrupt, truncated or foreign."""


class DatasetError(GSOError, ValueError):
    """A dataset cannot be read or written."""


class SchedulerError(DatasetError):
    """A scheduler does not answer or has no workers."""


class ConvergenceWarning(UserWarning):
    """A result was returned with a status other than converged or all iterations used."""
