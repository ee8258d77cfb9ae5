"""What `train forms` does: renders things whose places are known, and learns their forms."""

from typing import Any

from services.commands.output import counting_bars


def learn() -> dict[str, Any]:
    """Render, learn, measure; returns what was measured on held-out looks.

    Raises:
        MissingComponentError: a Vulkan device is missing.
    """
    from services.perception.space.forms import default_forms
    from sim import vulkan

    vulkan.activate()
    from services.perception.training.forms.train import SCENES, train_forms

    with counting_bars() as bar:
        tasks = {
            part: bar.add_task(f"rendering {part} scenes", total=n) for part, n in SCENES.items()
        }
        return train_forms(
            default_forms, lambda part, done, _: bar.update(tasks[part], completed=done)
        )
