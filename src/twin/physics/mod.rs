//! Rigid bodies: the train, the obstacles, the worker. The only room that knows rapier.
