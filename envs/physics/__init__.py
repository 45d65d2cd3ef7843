"""Physics of one world: state in, state and sensors out; see `backends` for which."""

from envs.physics.base import ModelFields, Physics, PhysicsOutput, PhysicsState

__all__ = ["ModelFields", "Physics", "PhysicsOutput", "PhysicsState"]
