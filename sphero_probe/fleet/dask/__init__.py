"""Run one action on many robots of several hosts: a Dask scheduler between this process and the workers.

``DaskFleet`` is the main class. It submits one task for each robot. ``Station``, in the process of each
worker, runs the task with ``on_robot.run_on_robot``, as one host does, in the worker's event loop; no thread
and no process of it can outlive the worker. Workers offer each robot that they reach as a Dask resource, and
the robot's task needs that resource; so it waits until a worker reaches its robot.

The journal is kept by the client, which is the process that runs ``DaskFleet``:

1. A task that begins says ``Hello``. The client answers with ``Begin`` and the lines that the journal holds;
   so only what is missing is sent, also if Dask has moved the task to another worker. From then on, the
   client ignores what an earlier execution of the task says.
2. The worker sends ``Grown`` with new lines as they are made. Before a probe above the class ``probe`` is
   sent, its intent must be in the client's file: the worker waits for ``Written``. So it is not sent twice,
   even if a worker dies, or goes on with an execution that was replaced.
3. A worker that hears that its client or its scheduler is gone ends the run.

All messages pass the scheduler as structured events over connections that the workers and the client have
opened; none of them has to be reachable for the others.
"""
