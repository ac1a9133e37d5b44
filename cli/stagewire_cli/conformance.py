"""x"""
import typer
app = typer.Typer()
@app.command("examples")
def examples() -> None:
    """x"""
@app.callback()
def _group() -> None:
    """x"""
