"""How a walk differs from a healthy one: cycles, features, effect sizes, and what people's limps look like."""
